"""Longitudes and latitudes along the axes of a map whose units are metres."""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._types import Bounds
from cgla_graph.model.earth import LocalProjection

Ticks: TypeAlias = list[tuple[float, str]]

#: Digits of a label, at most; steps between labels, times a power of ten; and labels of an axis, about.
DIGITS, STEPS, LABELS = 6, (1.0, 2.0, 2.5, 5.0, 10.0), 6


def degree_text(value: float, letters: str, step: float) -> str:
    """
    Write a longitude or latitude with as many digits as steps of `step` need.

    Examples
    --------
    >>> degree_text(24.5, "EW", 0.5), degree_text(-60.0, "NS", 1.0), degree_text(0.0, "EW", 1.0)
    ('24.5° E', '60° S', '0°')
    """
    value = (value + 180.0) % 360.0 - 180.0 if letters == "EW" else value
    digits = next((n for n in range(DIGITS) if math.isclose(step * 10**n, round(step * 10**n), abs_tol=1e-6)), DIGITS)
    number = f"{abs(value):.{digits}f}"
    return f"{number}°" if float(number) == 0.0 else f"{number}° {letters[value < 0.0]}"


def degree_ticks(projection: LocalProjection, bounds: Bounds) -> tuple[Ticks, Ticks]:
    """
    Return places and labels of longitudes along the lower edge of a map, and of latitudes along its left edge.

    Parameters
    ----------
    projection
        The projection of the map.
    bounds
        The edges of the map, metres.

    Returns
    -------
    x, y
        Places, metres, and their labels.

    Raises
    ------
    ProblemError
        If a corner is farther away than any place of the Earth.

    Examples
    --------
    >>> x, y = degree_ticks(LocalProjection(24.5, 60.0), (-50_000.0, -50_000.0, 50_000.0, 50_000.0))
    >>> [label for _, label in x], round(y[1][0])
    (['24.0° E', '24.5° E', '25.0° E'], -21946)
    """
    x_min, y_min, x_max, y_max = bounds
    found: list[Ticks] = []
    for side, letters in enumerate(("EW", "NS")):
        low, high = ((x_min, x_max), (y_min, y_max))[side]
        along = np.linspace(low, high, 129)
        edge = np.column_stack([along, np.full(129, y_min)] if side == 0 else [np.full(129, x_min), along])
        degrees = projection.inverse(edge)[:, side]
        if side == 0:
            # across the antimeridian, longitudes go on beyond 180
            degrees = projection.longitude + (degrees - projection.longitude + 180.0) % 360.0 - 180.0
        first, last = float(degrees.min()), float(degrees.max())
        rough = max((last - first) / LABELS, 10.0**-DIGITS)
        unit = 10.0 ** math.floor(math.log10(rough))
        step = unit * next(one for one in STEPS if one * unit >= rough * (1.0 - 1e-9))
        values = step * np.arange(math.ceil(first / step), math.floor(last / step) + 1)
        order = np.argsort(degrees)
        places = np.interp(values, degrees[order], along[order])
        found.append(
            [(float(at), degree_text(one, letters, step)) for at, one in zip(places, values.tolist(), strict=True)]
        )
    return found[0], found[1]
