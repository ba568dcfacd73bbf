"""Grids of the certificate over a whole map, what their bounds lose, and outlines that lack something."""

import math

import numpy as np

import cgla_graph as cg
from cgla_graph._types import Bounds, FloatArray, WholeArray
from cgla_graph.certificate.subsolution import Level
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.mesh_kernels import Outlines

SEVERAL = cg.RiskField([cg.Threat(0.5, 0.4, 0.1, 0.9), cg.Threat(0.3, 0.6, 0.15, 0.7), cg.Threat(0.7, 0.7, 0.2)])
Last = int | tuple[int, int]


def whole(problem: cg.Problem, last: Last, worth: float = math.inf, path: FloatArray | None = None) -> Level:
    """Lay a grid, of so many cells along each side, over all of a map."""
    last = (last, last) if isinstance(last, int) else last
    return Level.lay(problem, last, cell_runs.rectangle(last), worth, path)


def plain_level(field: cg.RiskField, k: float, last: Last, bounds: Bounds = (0.0, 0.0, 1.0, 1.0)) -> Level:
    """Lay a grid from corner to corner of a map without areas."""
    return whole(cg.Problem(bounds[:2], bounds[2:], field, k, bounds), last)


def missing(problem: cg.Problem, best: float, *lasts: Last, aim: float = 1e-3) -> list[float]:
    """Return by which share of the best cost the bounds of these grids fall short."""
    laid = [whole(problem, last).both(aim, charge=True) for last in lasts]
    return [1.0 - max(one.bound for one in bounds) / best for bounds in laid if bounds is not None]


def without_strips(parts: int, boxes: WholeArray, first_strip: WholeArray, strips: WholeArray) -> Outlines:
    """Return outlines in which no piece has strips."""
    return parts, boxes, np.full_like(first_strip, -1), strips
