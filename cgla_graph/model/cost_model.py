"""The cost of a straight segment: Eq. 5, and infinity where it crosses a no-fly area."""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import ShortRepr, shown
from cgla_graph._threads import in_parts, share_out
from cgla_graph._types import FloatArray
from cgla_graph._validate import fixed, non_negative_number, point_array, unmasked
from cgla_graph.errors import ProblemError
from cgla_graph.model import graph_kernels
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.risk import RiskField

#: Areas that are found by identity.
RECENT = 4


class MapKind(NamedTuple):
    """
    The parts of a map that need kernels of their own.

    Attributes
    ----------
    walls
        Whether it has a no-fly area.
    rasters
        Whether it has risk on rasters.

    Examples
    --------
    >>> import shapely
    >>> MapKind.of(CostModel(no_fly=shapely.box(0, 0, 1, 1)))
    MapKind(walls=True, rasters=False)
    """

    walls: bool = False
    rasters: bool = False

    @classmethod
    def of(cls, model: "CostModel | None") -> "MapKind":
        """Return the kind of a map with a cost model; without one, as in a user's own graph, the simplest kind."""
        return cls() if model is None else cls(not model.area.is_empty, bool(model.field.rasters))


@dataclass(frozen=True)
class CostModel(ShortRepr):
    """
    The cost of segments, which every graph, solver and oracle uses.

    Parameters
    ----------
    field
        The risk field.
    k
        Risk weight, at least 0.
    no_fly
        Polygons that no segment may cross, or None.

    Raises
    ------
    ProblemError
        If a part is malformed.

    Examples
    --------
    >>> import shapely
    >>> model = CostModel(RiskField(), k=1.0, no_fly=shapely.box(1, -1, 2, 1))
    >>> model.weights([(0, 0), (0, 1)], [(3, 0), (3, 1)])
    array([inf,  3.])
    """

    field: RiskField = field(default_factory=RiskField)
    k: float = 0.0
    no_fly: BaseGeometry | None = None

    def __post_init__(self) -> None:
        """Check the parts."""
        if not isinstance(self.field, RiskField):
            msg = f"field is {shown(self.field)}; give a RiskField, as RiskField([Threat(x=…, y=…, spread=…)])"
            raise ProblemError(msg)
        object.__setattr__(self, "k", non_negative_number("k", self.k))
        object.__setattr__(self, "field", self.field.for_weight(self.k))
        _ = self.area

    @cached_property
    def area(self) -> NoFlyArea:
        """The no-fly polygons, indexed for exact crossing tests."""
        return indexed_area(self.no_fly)

    def kernel_model(self, *, mixed: bool = False) -> graph_kernels.Model:
        """Return the model as kernels take it (`RiskField.kernel_field`), with scratch memory of its own."""
        return self.k, self.field.kernel_field(mixed=mixed), self.area.kernel_arrays

    def weights(self, starts: ArrayLike, ends: ArrayLike) -> FloatArray:
        """
        Weigh segments by Eq. 5: length plus k times risk; infinity where a segment crosses the no-fly area.

        Parameters
        ----------
        starts, ends
            The segments' ends, both of shape ``(n, 2)``, map units.

        Returns
        -------
        weights
            Shape ``(n,)``, map units.

        Raises
        ------
        ProblemError
            If an array does not hold finite pairs.
        """
        first, second = point_array("starts", starts), point_array("ends", ends)
        if first.ndim != 2 or first.shape != second.shape:  # noqa: PLR2004 - two lists of points
            msg = f"starts have shape {first.shape}, ends {second.shape}; give both in shape (n, 2)"
            raise ProblemError(msg)
        weights = np.empty(len(first))

        def weigh(part: slice) -> None:
            # (costs beyond the largest float are infinite)
            with np.errstate(over="ignore"):
                weights[part] = np.hypot(*(second[part] - first[part]).T)
                weights[part][self.area.crosses(first[part], second[part])] = np.inf
                if self.k > 0.0:
                    free = np.isfinite(weights[part])
                    weights[part][free] += self.k * self.field.line_integral(first[part][free], second[part][free])

        in_parts(weigh, len(weights))
        return weights

    def pair(self, positions: FloatArray, tail: int, head: int, lattice_shape: tuple[int, int] = (0, 0)) -> float:
        """Weigh the segment between two nodes: an entry of `matrix`, to the last bit."""
        places = fixed(unmasked("positions", positions))
        return graph_kernels.pair_weight(places, *lattice_shape, tail, head, self.kernel_model(mixed=True))

    def row(self, positions: FloatArray, node: int, lattice_shape: tuple[int, int] = (0, 0)) -> FloatArray:
        """Weigh the segments between one node and all, shape ``(n,)``: a row of `matrix`, to the last bit."""
        out, places = np.empty(len(positions)), fixed(unmasked("positions", positions))
        graph_kernels.complete_row(places, *lattice_shape, node, self.kernel_model(mixed=True), out)
        return out

    def matrix(self, positions: FloatArray, lattice_shape: tuple[int, int] = (0, 0)) -> FloatArray:
        """
        Weigh the segments between all pairs of nodes, using all cores.

        Parameters
        ----------
        positions
            Shape ``(n, 2)``, map units. The first ``nx * ny`` are a lattice of `lattice_shape`, row by row.
        lattice_shape
            ``(nx, ny)``; ``(0, 0)`` if no part is a lattice.

        Returns
        -------
        matrix
            Shape ``(n, n)``, map units: symmetric, 0 on the diagonal. No other array of that size is made.
        """
        n_nodes, positions = len(positions), fixed(unmasked("positions", positions))
        out = np.empty((n_nodes, n_nodes))
        share_out(
            lambda first, step: graph_kernels.complete_share(
                positions, *lattice_shape, self.kernel_model(mixed=True), first, step, out
            ),
            n_nodes,
        )
        share_out(lambda first, step: graph_kernels.complete_sums(*lattice_shape, first, step, out), n_nodes)
        if not self.area.is_empty:
            area = self.area.kernel_arrays
            share_out(lambda first, step: graph_kernels.complete_crossings(positions, area, first, step, out), n_nodes)
        return out


def indexed_area(no_fly: BaseGeometry | None) -> NoFlyArea:
    """
    Index an area, once for all the problems on one map (errors as `NoFlyArea`).

    Examples
    --------
    >>> indexed_area(None) is indexed_area(None)
    True
    """
    global _recent  # noqa: PLW0603 - a cache
    # (hashing thousands of polygons takes milliseconds)
    for known, area in _recent:
        if known is no_fly:
            return area
    # other objects are refused with a message of ours, not by the cache
    if not isinstance(cast("object", no_fly), BaseGeometry | None):
        return NoFlyArea(no_fly)
    area = _indexed(no_fly)
    _recent = ((no_fly, area), *_recent[: RECENT - 1])
    return area


@lru_cache(maxsize=16)
def _indexed(no_fly: BaseGeometry | None) -> NoFlyArea:
    return NoFlyArea(no_fly)


#: The areas that were asked for last, which are found without hashing them.
_recent: tuple[tuple[BaseGeometry | None, NoFlyArea], ...] = ()
