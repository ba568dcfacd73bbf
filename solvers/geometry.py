"""Plane geometry that several solvers use: directions, points on the unit circle."""

import math

import numpy as np

from cgla_graph._types import FloatArray, Point


def bearing(here: Point, there: Point) -> float:
    """
    Return the direction from one place to another, radians counterclockwise from east.

    Examples
    --------
    >>> bearing((1.0, 1.0), (1.0, 3.0)) == math.pi / 2
    True
    """
    return math.atan2(there[1] - here[1], there[0] - here[0])


def wrapped(angle: float) -> float:
    """
    Return the same direction as an angle from -pi to pi.

    Examples
    --------
    >>> wrapped(1.5 * math.pi) == -0.5 * math.pi
    True
    """
    return math.remainder(angle, math.tau)


def unit_vectors(headings: FloatArray) -> FloatArray:
    """
    Return the vectors of length 1 in some directions.

    Parameters
    ----------
    headings
        Radians counterclockwise from east, shape ``(...)``.

    Returns
    -------
    vectors
        Shape ``(..., 2)``, no unit.

    Examples
    --------
    >>> unit_vectors(np.array([0.0, math.pi / 2.0])).round(9).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    vectors = np.empty((*np.shape(headings), 2))
    vectors[..., 0], vectors[..., 1] = np.cos(headings), np.sin(headings)
    return vectors


def around_circle(count: int, *, first: float = 0.0) -> FloatArray:
    """
    Return points evenly around the unit circle, counterclockwise: the corners of a regular polygon.

    Parameters
    ----------
    count
        How many, at least 1.
    first
        Direction of the first one from east, in steps between points: with 0.5, the points face the sides of the
        polygon that begins in the east.

    Returns
    -------
    points
        Shape ``(count, 2)``, no unit.

    Examples
    --------
    >>> around_circle(4).round(9).tolist()
    [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [-0.0, -1.0]]
    """
    return unit_vectors(2.0 * math.pi * (np.arange(count) + first) / count)
