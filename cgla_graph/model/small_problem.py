"""Small maps of each kind: a solver that runs on one loads the kernels that such maps need."""

from functools import cache

import shapely

from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk

#: A path on a small problem, around its wall and not straight.
SMALL_PATH = (0.0, 0.0), (0.2, 0.9), (1.0, 1.0)


def small_field(kind: MapKind) -> RiskField:
    """
    Return a field with a threat, and perhaps rasters: one that is interpolated and one that is not.

    Examples
    --------
    >>> field = small_field(MapKind(rasters=True))
    >>> len(field.threats), [raster.interpolation for raster in field.rasters]
    (1, ['bilinear', 'nearest'])
    """
    values, bounds = [[0.1, 0.2], [0.0, 0.1]], (0.0, 0.0, 1.0, 1.0)
    rasters = [RasterRisk(values, bounds=bounds, interpolation=how) for how in ("bilinear", "nearest") if kind.rasters]
    return RiskField([Threat(0.5, 0.5, 0.1)], rasters=rasters)


def small_problem(kind: MapKind) -> Problem:
    """
    Return a problem on a map of a kind that uses every kernel of that kind.

    Examples
    --------
    >>> problem = small_problem(MapKind(walls=True))
    >>> problem.field.rasters, problem.model.area.is_empty
    ((), False)
    """
    wall = shapely.box(0.45, 0.2, 0.55, 0.8) if kind.walls else None
    return Problem(SMALL_PATH[0], SMALL_PATH[-1], small_field(kind), k=10.0, no_fly=wall)


@cache
def load_oracle(kind: MapKind) -> None:
    """
    Load the kernels that evaluate paths, once in a process.

    Examples
    --------
    >>> load_oracle(MapKind())
    """
    small_problem(kind).evaluate(SMALL_PATH)
