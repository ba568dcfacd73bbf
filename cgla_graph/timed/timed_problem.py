"""Problems in space and time, and the oracle that evaluates every timed path."""

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
from cgla_graph._types import BoolArray, Bounds, FloatArray, IntArray, Point
from cgla_graph._validate import (
    choice,
    finite_number,
    fixed,
    instance,
    items,
    point,
    point_array,
    positive_number,
)
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import ROUNDING
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_kernels import unit_of
from cgla_graph.timed.leg_kernels import piece_risks
from cgla_graph.timed.moving import MovingThreat, motion_in_slab
from cgla_graph.timed.slabs import Slab
from cgla_graph.timed.timed_area import TimedArea, union_of
from cgla_graph.timed.timed_evaluation import (
    TIME_TOLERANCE,
    Timed,
    TimedEvaluation,
    snapped,
    split_at,
    timed_rows,
)
from cgla_graph.timed.wind import ground_speeds

#: Over which measure risk is integrated.
RiskPer: TypeAlias = Literal["ground", "time"]
RISK_PER = ("ground", "time")
MOVING = "a list of MovingThreat(track, spread, peak)"


@dataclass(frozen=True, eq=False)
class TimedProblem(ShortRepr):
    """
    A path to plan in space and time, while threats move, areas open and close, and the wind blows.

    The aircraft flies at constant airspeed. A path is feasible if it departs in time, stays inside the bounds and
    outside the areas that are closed; it may cross itself, and loops are paths too. Its cost is ``air_distance + k *
    risk``: in still air and with nothing that moves, that of the `Problem`.

    Parameters
    ----------
    start, goal, field, k, bounds, no_fly, clearance, projection
        As of a `Problem`: the part of the map that does not change.
    moving
        Threats that move. At each time, the risk is that of all threats together (Eq. 2), and that of rasters is
        added: `field_at`.
    areas
        Areas that are closed for a time. The clearance counts for them too while they are closed.
    speed
        Airspeed, map units per unit of time, above 0.
    departure
        When the path begins: a time, or the first and last of a window. Time before the departure costs nothing.
    wind
        ``(u, v)``: where the air goes, map units per unit of time; None: still air.
    fields
        Fields that replace `field` from a time on, as rasters by the hour: pairs ``(t, field)``, in order of time.
    waiting
        The price of a unit of time spent waiting in one place, above 0: `speed` prices it as flight. None: an aircraft
        that cannot wait. The wind must not be stronger than the speed, and risk counts as in flight in still air.
    latest
        The latest arrival; None: any.
    risk_per
        ``ground``: risk is gathered over the ground distance, as where people on the ground are at risk. ``time``: per
        unit of time; the field is then in risk per unit of time.

    Raises
    ------
    ProblemError
        If a part is malformed.

    Examples
    --------
    >>> storm = MovingThreat([(0, 0.5, 0.9), (1, 0.5, 0.1)], spread=0.1)
    >>> problem = TimedProblem((0.1, 0.5), (0.9, 0.5), moving=[storm], k=5.0, speed=0.8)
    >>> straight = problem.evaluate([(0, 0.1, 0.5), (1, 0.9, 0.5)])
    >>> round(straight.cost, 4), straight.feasible
    (1.6862, True)
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
    wind: tuple[float, float] | None = None
    no_fly: BaseGeometry | None = None
    fields: Sequence[tuple[float, RiskField]] = ()
    waiting: float | None = None
    latest: float | None = None
    clearance: float = 0.0
    risk_per: RiskPer = "ground"
    projection: LocalProjection | None = dataclasses.field(default=None, repr=False)

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
        if self.wind is not None:
            keep(self, "wind", point("wind", self.wind))
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
    def events(self) -> FloatArray:
        """The times at which a threat turns, an area opens or closes, or a field is replaced, rising, read-only."""
        times = [time for threat in self.moving for time in threat.times.tolist()]
        times += [time for area in self.areas for time in area.changes]
        return fixed(np.unique(np.array(times + [time for time, _ in self.fields])))

    @cached_property
    def _all_slabs(self) -> tuple[Slab, ...]:
        """The slabs between all events, from the beginning to the end of time."""
        edges = (-math.inf, *self.events.tolist(), math.inf)
        closed: dict[tuple[int, ...], BaseGeometry | None] = {}
        slabs = []
        for begins, ends in pairwise(edges):
            numbers = tuple(i for i, area in enumerate(self.areas) if area.is_there(begins))
            if numbers not in closed:
                closed[numbers] = union_of(self.no_fly, [self.areas[i].polygon for i in numbers])
            now = [later for time, later in self.fields if time <= begins]
            threats = motion_in_slab(self.moving, begins)
            slabs.append(
                Slab(begins, ends, threats, (now or [self.field])[-1], closed[numbers], self.bounds, self.clearance)
            )
        return tuple(slabs)

    def slab_at(self, time: float) -> Slab:
        """
        Return the slab between the events around a time; an event belongs to the slab that it begins.

        Its first and last time may be infinite.
        """
        return self._all_slabs[int(np.searchsorted(self.events, finite_number("time", time), side="right"))]

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
        >>> problem = TimedProblem((0.1, 0.1), (0.9, 0.9), moving=[storm], speed=0.1, departure=2)
        >>> [(slab.begins, slab.ends) for slab in problem.slabs(12)]
        [(2.0, 10.0), (10.0, 12.0)]
        """
        since = self.departures[0]
        if finite_number("until", until) <= since:
            msg = f"until is {until:g}, and the departure {since:g}; give a later time"
            raise ProblemError(msg)
        parts = ((slab, max(slab.begins, since), min(slab.ends, float(until))) for slab in self._all_slabs)
        return tuple(slab.part(begins, ends) for slab, begins, ends in parts if begins < ends)

    def field_at(self, time: float) -> RiskField:
        """
        Return the risk field at a time, moving threats included.

        Examples
        --------
        >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1)
        >>> TimedProblem((0, 0), (1, 1), moving=[storm], speed=1).field_at(5).threats
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

    def fly(self, path: ArrayLike, departure: float | None = None) -> FloatArray:
        """
        Return the timed path along waypoints, without waiting.

        Parameters
        ----------
        path
            Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units. Legs that take no time are left out.
        departure
            When it begins; None: at the first departure.

        Returns
        -------
        trajectory
            Rows ``(t, x, y)``.

        Raises
        ------
        ProblemError
            If the path is malformed, or the wind is too strong for a leg.

        Examples
        --------
        >>> TimedProblem((0, 0), (1, 0), speed=2, wind=(1, 0)).fly([(0, 0), (0.75, 0), (0, 0)]).tolist()
        [[0.0, 0.0, 0.0], [0.25, 0.75, 0.0], [1.0, 0.0, 0.0]]
        """
        waypoints = point_array("path", path)
        if waypoints.ndim != 2 or not len(waypoints):  # noqa: PLR2004 - a list of points
            msg = f"path has shape {waypoints.shape}; give at least one waypoint, shape (m, 2)"
            raise ProblemError(msg)
        begins = self.departures[0] if departure is None else finite_number("departure", departure)
        waypoints = waypoints[np.append(True, (np.diff(waypoints, axis=0) != 0.0).any(axis=1))]
        steps = np.diff(waypoints, axis=0)
        speeds = self._ground_speeds(steps)
        weak = np.nonzero(~(speeds > 0.0))[0]
        if len(weak):
            msg = (
                f"leg {weak[0]} cannot be flown: the wind {self.wind} is too strong for airspeed {self.speed:g}; "
                "fly another way, or faster"
            )
            raise ProblemError(msg)
        times = begins + np.append(0.0, np.cumsum(np.hypot(*steps.T) / speeds))
        # (of several waypoints that rounding puts at one time, the last one counts, but the first of all stays)
        kept = np.append(np.diff(times) > 0.0, True)
        rows: FloatArray = np.column_stack([times, waypoints])[kept]
        rows[0, 1:] = waypoints[0] if len(rows) > 1 else waypoints[-1]
        return rows

    def evaluate(self, trajectory: Timed) -> TimedEvaluation:
        """
        Evaluate any timed path: the oracle that judges all solvers.

        Between two rows, it moves straight on at constant speed, or waits if the places are equal. Times that differ
        from those of the flight by less than 1e-9 of the time since departure count as equal; the flight's are used.

        Parameters
        ----------
        trajectory
            Rows ``(t, x, y)``, shape ``(m, 3)`` with ``m >= 1``, times increasing; or a `Trajectory`. It need not join
            start and goal.

        Returns
        -------
        evaluation
            Times, distances, risk and cost, and why the path is infeasible. The cost is within 1e-9 of itself.

        Raises
        ------
        ProblemError
            If the rows are malformed.

        Examples
        --------
        >>> import shapely
        >>> gate = TimedArea(shapely.box(0.4, -1, 0.6, 2), appears=0, vanishes=2)
        >>> problem = TimedProblem((0.1, 0.5), (0.9, 0.5), areas=[gate], speed=0.1, waiting=0.05)
        >>> problem.evaluate(problem.fly([(0.1, 0.5), (0.9, 0.5)])).feasible
        True
        >>> problem.evaluate([(0, 0.35, 0.5), (5.5, 0.9, 0.5)]).violations
        ('leg 0 crosses a closed area after time 0',)
        """
        given = timed_rows(trajectory)
        faults, rows = self._flown(given)
        steps, taken = np.diff(rows[:, 1:], axis=0), np.diff(rows[:, 0])
        lengths = np.hypot(*steps.T)
        waits = lengths == 0.0
        air = np.hypot(*(steps - taken[:, None] * np.array(self.wind or (0.0, 0.0))).T)
        pieces, legs = split_at(rows, self.events) if len(rows) > 1 else (rows[[0, 0]], np.zeros(1, dtype=int))
        which = np.searchsorted(self.events, pieces[:-1, 0], side="right")
        risk = self._risk(pieces, waits[legs] if len(rows) > 1 else np.array([True]), which)
        clearance, crossed = self._clearance(pieces, legs, which)
        waited = float(taken[waits].sum())
        air_distance = float(air[~waits].sum())
        price = self.speed if self.waiting is None else self.waiting
        return TimedEvaluation(
            departure=float(rows[0, 0]),
            arrival=float(rows[-1, 0]),
            air_distance=air_distance,
            ground_distance=float(lengths.sum()),
            waiting=waited,
            risk=risk,
            cost=air_distance + price * waited + self.k * risk,
            clearance=clearance,
            violations=(*self._out_of_time(rows), *self._outside(rows), *faults, *crossed),
        )

    def _ground_speeds(self, steps: FloatArray) -> FloatArray:
        return ground_speeds(steps, np.array(self.wind or (0.0, 0.0)), self.speed)

    def _flown(self, given: FloatArray) -> tuple[list[str], FloatArray]:
        """Return what is wrong with the times of rows, and the rows at the times of the flight if nothing is."""
        steps, taken = np.diff(given[:, 1:], axis=0), np.diff(given[:, 0])
        lengths = np.hypot(*steps.T)
        waits = lengths == 0.0
        needed = taken.copy()
        speeds = ground_speeds(steps[~waits], np.array(self.wind or (0.0, 0.0)), self.speed)
        needed[~waits] = lengths[~waits] / speeds
        times = given[0, 0] + np.append(0.0, np.cumsum(needed))
        off = ~(np.abs(times - given[:, 0]) <= TIME_TOLERANCE * (given[:, 0] - given[0, 0]) + 2.0 * np.spacing(times))
        faults = [self._late(leg, taken[leg], needed[leg]) for leg in np.nonzero(off[1:])[0][:1]]
        for leg in np.nonzero(waits)[0][:1]:
            if self.waiting is None:
                faults.append(f"leg {leg} waits, and waiting has no price")
            elif self.wind is not None and math.hypot(*self.wind) > self.speed:
                faults.append(f"leg {leg} waits in a wind that is faster than the airspeed {self.speed:g}")
        if off.any():
            return faults, given
        return faults, np.column_stack([snapped(times, self.events), given[:, 1:]])

    def _late(self, leg: int, taken: float, needed: float) -> str:
        if not needed > 0.0:
            return f"leg {leg} cannot be flown: the wind is too strong for airspeed {self.speed:g}"
        return f"leg {leg} takes {taken:.9g}, and at airspeed {self.speed:g} it takes {needed:.9g}"

    def _risk(self, pieces: FloatArray, waits: BoolArray, which: IntArray) -> float:
        """Integrate the risk over pieces, each in the slab of that number."""
        durations = np.diff(pieces[:, 0])
        flown = np.column_stack([pieces[:-1, 1:], pieces[1:, 1:], durations])
        flown[waits, 2:4] = flown[waits, :2]
        risks = np.zeros(len(flown))
        deeper = -math.log(self.risk_unit)
        for number in np.unique(which):
            slab, here = self._all_slabs[number], which == number
            begins = slab.begins if math.isfinite(slab.begins) else 0.0
            part = np.zeros(int(here.sum()))
            field = slab.field.for_weight(self.k).kernel_field()
            piece_risks(flown[here], pieces[:-1, 0][here] - begins, slab.threats, field, deeper, part)
            risks[here] = part
        if self.risk_per == "time":
            lengths = np.hypot(*(flown[:, 2:4] - flown[:, :2]).T)
            return float((risks * np.where(waits, 1.0, durations / np.where(waits, 1.0, lengths))).sum())
        return float((risks * np.where(waits, self.speed, 1.0)).sum())

    def _clearance(self, pieces: FloatArray, legs: IntArray, which: IntArray) -> tuple[float, list[str]]:
        """Return the least distance to closed areas, and which leg crosses one first, or comes too near."""
        least, faults = math.inf, list[str]()
        x_min, y_min, x_max, y_max = self.bounds
        ends = np.append(which, np.searchsorted(self.events, pieces[-1, 0], side="right"))
        for number in np.unique(ends):
            slab = self._all_slabs[number]
            if slab.no_fly is None:
                continue
            here = np.nonzero(which == number)[0]
            starts = pieces[here, 1:] if len(here) else pieces[-1:, 1:]
            stops = pieces[here + 1, 1:] if len(here) else starts
            crossed = here[slab.area.crosses(starts, stops)] if len(here) else np.nonzero(slab.area.contains(starts))[0]
            if len(crossed) and not faults:
                at = pieces[crossed[0], 0] if len(here) else pieces[-1, 0]
                leg = legs[crossed[0]] if len(here) else legs[-1]
                faults.append(f"leg {leg} crosses a closed area after time {at:.9g}")
            given = indexed_area(slab.no_fly)
            least = min(least, *(given.path_clearance(np.vstack(pair)) for pair in zip(starts, stops, strict=True)))
        if not faults and least < self.clearance - ROUNDING * max(x_max - x_min, y_max - y_min):
            faults.append(f"it comes within {least:.6g} of a closed area, and the clearance is {self.clearance:g}")
        return least, faults

    def _outside(self, rows: FloatArray) -> list[str]:
        outside = np.nonzero(~self.still.in_bounds(rows[:, 1:]))[0]
        return [f"row {i} leaves the bounds" for i in outside[:1]]

    def _out_of_time(self, rows: FloatArray) -> list[str]:
        first, last = self.departures
        departs, arrives = rows[0, 0], rows[-1, 0]
        found = []
        if not first <= departs <= last:
            when = f"{first:g}" if first == last else f"between {first:g} and {last:g}"
            found.append(f"it departs at {departs:.9g}, and may depart at {when}".replace("at between", "between"))
        if self.latest is not None and arrives > self.latest:
            found.append(f"it arrives at {arrives:.9g}, and the latest arrival is {self.latest:g}")
        return found


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
