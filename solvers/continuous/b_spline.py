"""Clamped B-splines: smooth curves from a few control points, many curves at once."""

import numpy as np
from scipy.interpolate import BSpline

from cgla_graph._types import FloatArray

#: Cubic: the curvature is continuous.
DEGREE = 3


def basis(n_controls: int, n_points: int, *, derivative: int = 0) -> FloatArray:
    """
    Return what each control point contributes to points of a clamped uniform B-spline, cubic where there are enough.

    A curve begins at its first control point and ends at its last, along the lines to their neighbours, and stays in
    the convex hull of all (Piegl, Tiller: The NURBS Book, 1997, chapter 3).

    Parameters
    ----------
    n_controls
        Control points, at least 2; with fewer than 4, the degree is one less than that.
    n_points
        Points on the curve, at least 2, evenly spaced in the parameter, which runs from 0 to 1.
    derivative
        Of the curve, by its parameter: 0 is the curve itself.

    Returns
    -------
    matrix
        Shape ``(n_points, n_controls)``: ``matrix @ controls`` are points (or derivatives there).

    Examples
    --------
    >>> basis(4, 3) @ [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
    array([[0.  , 0.  ],
           [0.5 , 0.75],
           [1.  , 0.  ]])
    """
    degree = min(DEGREE, n_controls - 1)
    inner = np.linspace(0.0, 1.0, n_controls - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    curve = BSpline(knots, np.eye(n_controls), degree)
    return np.asarray(curve(np.linspace(0.0, 1.0, n_points), nu=derivative), dtype=np.float64)


def curvature(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """
    Return the curvature of curves from their first two derivatives, one over map units.

    Parameters
    ----------
    velocity, acceleration
        Shape ``(..., 2)``, by any parameter.

    Returns
    -------
    curvature
        Shape ``(...)``, at least 0; infinite where the curve stands still.

    Examples
    --------
    >>> float(curvature(np.array([0.0, 2.0]), np.array([-2.0, 0.0])))
    0.5
    """
    cross = velocity[..., 0] * acceleration[..., 1] - velocity[..., 1] * acceleration[..., 0]
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        bent = np.abs(cross) / speed**3
    return np.where(speed > 0.0, bent, np.inf)
