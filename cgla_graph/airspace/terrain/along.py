"""Pieces of legs, cut where the ground changes: at the edges of cells, or at lines between their centres."""

import itertools
from collections.abc import Iterator

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.airspace.terrain.surface import Pieces, Surface


def leg_by_leg(pieces: Pieces) -> Iterator[tuple[int, Pieces]]:
    """Yield each leg with its pieces."""
    firsts = np.concatenate([[0], np.nonzero(np.diff(pieces.leg))[0] + 1, [len(pieces.leg)]]).tolist()
    for first, last in itertools.pairwise(firsts):
        part = slice(first, last)
        yield int(pieces.leg[first]), Pieces(pieces.leg[part], pieces.shares[part], pieces.lonlat[part])


def _split(part: Pieces, cuts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split pieces at shares of each, shape ``(m, k)``; return shares of the leg, ``(n, 2)``, and places."""
    within = np.clip(np.nan_to_num(cuts, nan=0.0), 0.0, 1.0)
    edge = np.zeros((len(cuts), 1))
    marks = np.sort(np.concatenate([edge, within, edge + 1.0], axis=1), axis=1)
    pairs = np.stack([marks[:, :-1], marks[:, 1:]], axis=-1)
    keep = pairs[..., 1] > pairs[..., 0]
    index = np.broadcast_to(np.arange(len(cuts))[:, None], keep.shape)[keep]
    pairs = pairs[keep]
    first, last = part.shares[index, :1], part.shares[index, 1:]
    begin, end = part.lonlat[index, None, 0], part.lonlat[index, None, 1]
    return first + pairs * (last - first), begin + pairs[..., None] * (end - begin)


def cut_at_edges(part: Pieces, surface: Surface) -> tuple[FloatArray, FloatArray]:
    """
    Split pieces of one leg at the edges of the ground's cells, a rounding before and behind each.

    Returns
    -------
    shares, lonlat
        Shares of the leg, shape ``(n, 2)``, and places, degrees, shape ``(n, 2, 2)``: end, coordinate.
    """
    position = surface.position(part.lonlat)
    start, step = position[:, 0], position[:, 1] - position[:, 0]
    near = np.round(position.mean(axis=1))
    rounding = surface.rounding(part.lonlat[:, 0, 1])
    with np.errstate(all="ignore"):
        cuts = np.concatenate([(near + sign * rounding - start) / step for sign in (-1.0, 1.0)], axis=1)
    return _split(part, cuts)


def elevations_along(part: Pieces, surface: Surface) -> tuple[FloatArray, FloatArray]:
    """
    Return shares of a leg between which the ground is quadratic, and its elevation: start, middle and end of each.

    Returns
    -------
    shares, elevations
        Shapes ``(n, 3)``; metres above the sea, NaN where unknown.
    """
    position = surface.position(part.lonlat)
    start, step = position[:, 0], position[:, 1] - position[:, 0]
    centre = np.floor(position.mean(axis=1)) + 0.5
    with np.errstate(all="ignore"):
        shares, lonlat = _split(part, (centre - start) / step)
    shares = np.column_stack([shares[:, 0], shares.mean(axis=1), shares[:, 1]])
    lonlat = np.stack([lonlat[:, 0], lonlat.mean(axis=1), lonlat[:, 1]], axis=1)
    return shares, surface.between(lonlat)
