"""Paths that lie within the width of a pen of each other: on paper they are one line."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.plots.looks import Entry

#: Between its corners, a segment is looked at every so many parts of its length.
_PARTS = 0.25
#: Corners that stand out less than this part of the pen's width are left out.
_FINE = 0.125
#: A line runs over another one where this part of the other one's length lies within its width.
_SHARED = 0.3


def lines_of(entries: Sequence[Entry], pen: float) -> list[list[Entry]]:
    """
    Put solvers together whose paths are one line; a path that may be flown is in none with one that may not.

    Parameters
    ----------
    entries
        Solvers with a path, the best first.
    pen
        The width of a line, map units.

    Returns
    -------
    lines
        The solvers of each line, in order: the first is the one to draw.
    """
    kinds = ([entry for entry in entries if entry.infeasible is infeasible] for infeasible in (False, True))
    return [
        [kind[number] for number in together]
        for kind in kinds
        for together in one_line([one.path for one in kind], pen)
    ]


def one_line(paths: Sequence[FloatArray], pen: float) -> list[list[int]]:
    """
    Group paths that no pen can draw apart.

    Parameters
    ----------
    paths
        Shape ``(n, 2)`` each, at least one point; the ones to be drawn before others come first.
    pen
        The width of a line, in units of the paths.

    Returns
    -------
    groups
        The numbers of the paths, in order. The first of each group leads it: all others have no point further than
        `pen` from it, nor it from them.

    Examples
    --------
    >>> straight = np.array([(0.0, 0.0), (1.0, 1.0)])
    >>> one_line([straight, straight + 0.1, straight + 1e-4], pen=0.001)
    [[0, 2], [1]]
    """
    lines = [_line(path, pen) for path in paths]
    groups: list[list[int]] = []
    for number, line in enumerate(lines):
        for group in groups:
            if shapely.hausdorff_distance(lines[group[0]], line, densify=_PARTS) <= pen:
                group.append(number)
                break
        else:
            groups.append([number])
    return groups


def n_above(paths: Sequence[FloatArray], pen: float) -> list[int]:
    """
    Count for each path the ones before it that run over it for a while, so that a wider line shows it beside them.

    Parameters
    ----------
    paths
        Shape ``(n, 2)`` each, at least one point; the first is drawn on top.
    pen
        The width of a line, in units of the paths.

    Examples
    --------
    >>> straight = np.array([(0.0, 0.0), (1.0, 1.0)])
    >>> bent, aside = np.array([(0.0, 0.0), (0.5, 0.5), (1.0, 0.5)]), straight + (0.0, 0.1)
    >>> n_above([straight, bent, aside], pen=0.001)
    [0, 1, 0]
    """
    lines = [_line(path, pen) for path in paths]
    around = [line.buffer(pen) for line in lines]
    return [
        sum(line.intersection(other).length > _SHARED * line.length for other in around[:number])
        for number, line in enumerate(lines)
    ]


def _line(path: FloatArray, pen: float) -> BaseGeometry:
    """Return a path as a line, without what is too fine to be seen; one of a point too."""
    return LineString(np.vstack([path, path[-1:]])).simplify(_FINE * pen)
