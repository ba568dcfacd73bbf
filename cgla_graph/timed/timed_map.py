"""The map in time: what moves, opens, closes and blows, between which events, and what flies in it."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import (
    choice,
    finite_number,
    fixed,
    instance,
    items,
    non_negative_number,
    point,
    positive_number,
)
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_kernels import unit_of
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.timed.moving import MovingThreat, motion_in_slab
from cgla_graph.timed.slabs import Slab
from cgla_graph.timed.timed_area import TimedArea, union_of
from cgla_graph.timed.tolls import Toll, tolls_from
from cgla_graph.timed.wind import Wind

#: Over which measure risk is integrated.
RiskPer: TypeAlias = Literal["ground", "time"]
RISK_PER = ("ground", "time")
MOVING = "a list of MovingThreat(track, spread, peak)"


@dataclass(frozen=True, eq=False)
class TimedMap(ShortRepr):
    """
    The parts of a `TimedProblem`, where they are described, and the slabs that they make.

    Examples
    --------
    >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1)
    >>> TimedMap((0, 0), (1, 1), moving=[storm], speed=1).events.tolist()
    [0.0, 10.0]
    """

    start: Point
    goal: Point
    field: RiskField = field(default_factory=RiskField)
    moving: Sequence[MovingThreat] = ()
    areas: Sequence[TimedArea] = ()
    _: KW_ONLY
    speed: float
    k: float = 0.0
    bounds: Bounds = (0.0, 0.0, 1.0, 1.0)
    departure: float | tuple[float, float] = 0.0
    wind: tuple[float, float] | Wind | None = None
    no_fly: BaseGeometry | None = None
    fields: Sequence[tuple[float, RiskField]] = ()
    waiting: float | None = None
    latest: float | None = None
    clearance: float = 0.0
    others: Sequence[Trajectory] = ()
    separation: float = 0.0
    risk_per: RiskPer = "ground"
    projection: LocalProjection | None = dataclasses.field(default=None, repr=False)
    #: Of the bound of a team (`tolled`).
    tolls: tuple[Toll, ...] = dataclasses.field(default=(), init=False, repr=False)

    def __post_init__(self) -> None:
        """Check all parts once, so that no solver has to."""
        keep = object.__setattr__
        still = Problem(
            self.start, self.goal, self.field, self.k, self.bounds, self.no_fly, self.clearance, self.projection
        )
        for name in ("start", "goal", "field", "k", "bounds", "clearance", "projection"):
            keep(self, name, getattr(still, name))
        keep(self, "_still", still)
        keep(self, "moving", items("moving", self.moving, MOVING))
        for number, threat in enumerate(self.moving):
            instance(f"moving {number}", threat, MovingThreat, "MovingThreat(track, spread, peak)")
        keep(self, "areas", items("areas", self.areas, "a list of TimedArea(polygon, appears, vanishes)"))
        for number, area in enumerate(self.areas):
            instance(f"area {number}", area, TimedArea, "TimedArea(polygon, appears, vanishes)")
        keep(self, "fields", tuple(_checked_fields(self.fields)))
        for one in (self.field, *(later for _, later in self.fields)):
            _refuse_field(one)
        keep(self, "speed", positive_number("speed", self.speed))
        keep(self, "departure", _checked_departure(self.departure))
        if self.wind is not None and not isinstance(self.wind, Wind):
            keep(self, "wind", point("wind", self.wind))
        keep(self, "others", items("others", self.others, "a list of Trajectory(times, points)"))
        for number, other in enumerate(self.others):
            instance(f"trajectory {number} of others", other, Trajectory, "Trajectory(times, points)")
        keep(self, "separation", non_negative_number("separation", self.separation))
        if self.waiting is not None:
            keep(self, "waiting", positive_number("waiting", self.waiting))
        if self.latest is not None:
            keep(self, "latest", finite_number("latest", self.latest))
            if self.latest < self.departures[0]:
                first = self.departures[0]
                msg = f"latest arrival is {self.latest:g}, before the departure at {first:g}; let it be later"
                raise ProblemError(msg)
        choice("risk_per", self.risk_per, RISK_PER)

    @property
    def still(self) -> Problem:
        """The problem in the plane without anything that moves, opens or closes."""
        problem: Problem = self._still  # type: ignore[attr-defined]
        return problem

    @property
    def departures(self) -> tuple[float, float]:
        """The first and last departure."""
        return self.departure if isinstance(self.departure, tuple) else (self.departure, self.departure)

    @property
    def is_still(self) -> bool:
        """Whether nothing changes in time: no threat moves, no area or field comes or goes."""
        return not len(self.events)

    @cached_property
    def wind_grid(self) -> Wind:
        """The wind as a grid; of one node, if it was given as a vector, or not at all."""
        return self.wind if isinstance(self.wind, Wind) else Wind.of(*self.wind or (0.0, 0.0))

    @cached_property
    def constant_wind(self) -> tuple[float, float] | None:
        """The wind, if it is the same everywhere and always, ``(0, 0)`` in still air; else None."""
        return self.wind_grid.constant if self.wind_grid.is_constant else None

    @cached_property
    def events(self) -> FloatArray:
        """The times at which a threat turns, an area opens or closes, a field or a wind is replaced: rising."""
        times = [time for threat in self.moving for time in threat.times.tolist()]
        times += [time for area in self.areas for time in area.changes]
        times += [time for time, _ in self.fields]
        times += self.wind_grid.changes
        times += [time for toll in self.tolls for time in toll.centre.times.tolist()]
        return fixed(np.unique(np.array(times)))

    @cached_property
    def all_slabs(self) -> tuple[Slab, ...]:
        """The slabs between all events, from the beginning to the end of time: their first and last are infinite."""
        edges = (-math.inf, *self.events.tolist(), math.inf)
        closed: dict[tuple[int, ...], BaseGeometry | None] = {}
        slabs = []
        for begins, ends in pairwise(edges):
            numbers = tuple(i for i, area in enumerate(self.areas) if area.is_there(begins))
            if numbers not in closed:
                closed[numbers] = union_of(self.no_fly, [self.areas[i].polygon for i in numbers])
            now = [later for time, later in self.fields if time <= begins]
            threats = motion_in_slab(self.moving, begins)
            field, tolls = (now or [self.field])[-1], tolls_from(self.tolls, begins)
            slabs.append(Slab(begins, ends, threats, field, closed[numbers], self.bounds, self.clearance, tolls))
        return tuple(slabs)

    def wind_at(self, points: ArrayLike, time: float) -> FloatArray:
        """
        Return the wind at places, shape ``(..., 2)``, and a time.

        Examples
        --------
        >>> TimedMap((0, 0), (1, 1), speed=2, wind=(1, 0)).wind_at([(0, 0), (1, 1)], 5).tolist()
        [[1.0, 0.0], [1.0, 0.0]]
        """
        return self.wind_grid.at(points, time)

    def slab_at(self, time: float) -> Slab:
        """
        Return the slab between the events around a time; an event belongs to the slab that it begins.

        Its first or last time may be infinite.
        """
        return self.all_slabs[int(np.searchsorted(self.events, finite_number("time", time), side="right"))]

    def slabs(self, until: float) -> tuple[Slab, ...]:
        """
        Return the slabs from the first departure until a time, in order.

        Parameters
        ----------
        until
            A time after the first departure.

        Returns
        -------
        slabs
            The first begins at the first departure, the last ends at `until`; between them are the events.

        Raises
        ------
        ProblemError
            If `until` is not after the first departure.

        Examples
        --------
        >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1)
        >>> problem = TimedMap((0.1, 0.1), (0.9, 0.9), moving=[storm], speed=0.1, departure=2)
        >>> [(slab.begins, slab.ends) for slab in problem.slabs(12)]
        [(2.0, 10.0), (10.0, 12.0)]
        """
        since = self.departures[0]
        if finite_number("until", until) <= since:
            msg = f"until is {until:g}, and the departure {since:g}; give a later time"
            raise ProblemError(msg)
        parts = ((slab, max(slab.begins, since), min(slab.ends, float(until))) for slab in self.all_slabs)
        return tuple(slab.part(begins, ends) for slab, begins, ends in parts if begins < ends)

    def field_at(self, time: float) -> RiskField:
        """
        Return the risk field at a time, moving threats included.

        Examples
        --------
        >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1)
        >>> TimedMap((0, 0), (1, 1), moving=[storm], speed=1).field_at(5).threats
        (Threat(x=0.5, y=0.5, spread=0.1, peak=1.0),)
        """
        still = self.slab_at(time).field
        return still.with_threats(threat.at(time) for threat in self.moving) if self.moving else still

    @cached_property
    def risk_unit(self) -> float:
        """The risk per unit length that is the measure of all cut-offs, as `RiskField.unit`."""
        fields = (self.field, *(later for _, later in self.fields))
        peaks = [threat.peak for each in fields for threat in each.threats]
        peaks += [float(threat.rows[:, -1].max()) for threat in self.moving]
        return unit_of(max(peaks, default=1.0), self.k)


def _checked_departure(given: object) -> float | tuple[float, float]:
    if not isinstance(given, tuple | list):
        return finite_number("departure", given)
    if len(given) != 2:  # noqa: PLR2004 - a first and a last
        msg = f"departure is {shown(given)}; give a time, or the first and last of a window"
        raise ProblemError(msg)
    first, last = (finite_number("departure", each) for each in given)
    if first > last:
        msg = f"departure is {shown(given)}, and its window ends before it begins; give (first, last)"
        raise ProblemError(msg)
    return first, last


def _checked_fields(given: object) -> Iterable[tuple[float, RiskField]]:
    before = -math.inf
    for number, pair in enumerate(items("fields", given, "a list of (time, RiskField)")):
        if not isinstance(pair, tuple | list) or len(pair) != 2:  # noqa: PLR2004 - time and field
            msg = f"field {number} of fields is {shown(pair)}; give (time, RiskField)"
            raise ProblemError(msg)
        time = finite_number(f"the time of field {number} of fields", pair[0])
        instance(f"field {number} of fields", pair[1], RiskField, "(time, RiskField)")
        if time <= before:
            msg = f"field {number} of fields begins at {time:g}, not after {before:g}; give them in order of time"
            raise ProblemError(msg)
        before = time
        yield time, pair[1]


def _refuse_field(field: RiskField) -> None:
    """Refuse fields that a bound in time could not hold for."""
    if field.is_mixture or not field.is_proper:
        kind = "of several scenarios" if field.is_mixture else "improper, with peaks above 1"
        msg = f"field is {kind}; a timed problem takes a RiskField with peaks in (0, 1]"
        raise ProblemError(msg)
