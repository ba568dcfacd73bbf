"""The lattice: the points that become the nodes of a graph."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import bounds_box, is_one_of
from cgla_graph._validate import point as pair
from cgla_graph.errors import ProblemError

LatticeKind: TypeAlias = Literal["closed", "upper", "lower", "centre"]

#: A lattice point this close to a given point, in lattice steps, counts as that point.
SNAP = 1e-9
#: More points a side than this are refused as a mistake.
MOST_A_SIDE = 1_000_000


@dataclass(frozen=True)
class Lattice:
    """
    Evenly spaced points over a box; point ``ix + iy * nx`` is the ``ix``-th from the left, ``iy``-th from below.

    Parameters
    ----------
    resolution
        Points a side, at least 2: one number, or ``(nx, ny)``.
    bounds
        The box ``(x_min, y_min, x_max, y_max)``, map units.
    kind
        Position of the ``n`` points on a side of length 1. ``closed``: from border to border, ``i / (n - 1)``;
        ``upper``: ``i / n`` for ``i = 1 … n`` (the paper's, by the coordinates it names); ``lower``: ``i / n`` from 0;
        ``centre``: the middles of ``n`` cells (grid maps).

    Raises
    ------
    ProblemError
        If a resolution is not a whole number of at least 2, the bounds are no box, or the kind is unknown.

    Examples
    --------
    >>> Lattice(3, bounds=(0, 0, 1, 1)).points[:3].tolist()
    [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]
    """

    resolution: int | tuple[int, int]
    bounds: Bounds = field(kw_only=True)
    kind: LatticeKind = field(default="closed", kw_only=True)

    def __post_init__(self) -> None:
        """Check the settings."""
        object.__setattr__(self, "bounds", bounds_box(self.bounds))
        if not is_one_of(self.kind, get_args(LatticeKind)):
            msg = f"unknown lattice kind {shown(self.kind)}; choose one of {', '.join(get_args(LatticeKind))}"
            raise ProblemError(msg)
        given: tuple[object, ...] = (
            tuple(self.resolution) if isinstance(self.resolution, tuple | list) else (self.resolution,) * 2
        )
        sides = [int(n) for n in given if isinstance(n, int | np.integer) and not isinstance(n, bool)]
        if not len(given) == len(sides) == 2 or min(sides) < 2 or max(sides) > MOST_A_SIDE:  # noqa: PLR2004 - two each
            msg = f"resolution is {shown(self.resolution)}; give one whole number of at least 2, or two (nx, ny)"
            raise ProblemError(msg)
        object.__setattr__(self, "resolution", (sides[0], sides[1]))

    @property
    def shape(self) -> tuple[int, int]:
        """Points along x and along y."""
        nx, ny = self.resolution  # type: ignore[misc]
        return nx, ny

    @property
    def n_points(self) -> int:
        """Points in all."""
        nx, ny = self.shape
        return nx * ny

    @property
    def spacing(self) -> Point:
        """Distance between neighbours along x and along y, map units."""
        x_min, y_min, x_max, y_max = self.bounds
        gaps = [n - 1 if self.kind == "closed" else n for n in self.shape]
        return (x_max - x_min) / gaps[0], (y_max - y_min) / gaps[1]

    @cached_property
    def points(self) -> FloatArray:
        """All points, shape ``(nx * ny, 2)``, map units, read-only."""
        x, y = (self._side(low, high, n) for low, high, n in self._sides())
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        points.flags.writeable = False
        return points

    def nearest(self, point: Point) -> int:
        """
        Return the index of the lattice point nearest to `point`.

        Raises
        ------
        ProblemError
            If `point` is not two finite numbers.

        Examples
        --------
        >>> Lattice(3, bounds=(0, 0, 1, 1)).nearest((0.9, 0.6))
        5
        """
        column, row = (
            int(np.abs(self._side(low, high, n) - value).argmin())
            for value, (low, high, n) in zip(pair("the point", point), self._sides(), strict=True)
        )
        return column + row * self.shape[0]

    def index_of(self, point: Point) -> int | None:
        """
        Return the index of the lattice point at `point`, or None where there is none (within 1e-9 of a step).

        Examples
        --------
        >>> Lattice(20, bounds=(0, 0, 1, 1)).index_of((0.1, 0.1)) is None
        True
        >>> Lattice(20, bounds=(0, 0, 1, 1), kind="upper").index_of((0.1, 0.1))
        21
        """
        nearest = self.nearest(point)
        off = np.abs(self.points[nearest] - point) / self.spacing
        return nearest if float(off.max()) <= SNAP else None

    def _sides(self) -> list[tuple[float, float, int]]:
        x_min, y_min, x_max, y_max = self.bounds
        return [(x_min, x_max, self.shape[0]), (y_min, y_max, self.shape[1])]

    def _side(self, low: float, high: float, n: int) -> FloatArray:
        fractions = {
            "closed": np.arange(n) / (n - 1),
            "upper": np.arange(1, n + 1) / n,
            "lower": np.arange(n) / n,
            "centre": (np.arange(n) + 0.5) / n,
        }[self.kind]
        # weights of both ends, so that the last point of a side is the border itself
        return np.asarray(low * (1.0 - fractions) + high * fractions)
