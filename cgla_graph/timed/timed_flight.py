"""How a timed path is flown: when it is where, by what risk, and what its times do not allow."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.model.risk import RiskField
from cgla_graph.timed.leg_kernels import piece_risks
from cgla_graph.timed.timed_evaluation import TIME_TOLERANCE, snapped, split_at
from cgla_graph.timed.timed_map import TimedMap
from cgla_graph.timed.wind import ground_speeds
from cgla_graph.timed.wind_kernels import advance

#: Pieces of a leg in wind on a grid: within each, the distance to others is that of motion at constant speed.
PIECES = 256


class TimedFlight(NamedTuple):
    """
    A timed path as it is flown, in pieces between rows and events.

    `rows` are those given, at the times of the flight. `pieces` are rows as well, one more than there are pieces;
    `legs` and `slabs` are the numbers of the leg and of the slab that each piece is in, `risks` those of the pieces.
    """

    rows: FloatArray
    pieces: FloatArray
    legs: IntArray
    slabs: IntArray
    risks: FloatArray
    air_distance: float
    waited: float
    faults: tuple[str, ...]


def flown(timed: TimedMap, given: FloatArray) -> TimedFlight:
    """
    Fly a timed path.

    Parameters
    ----------
    timed
        The map and the aircraft.
    given
        Rows ``(t, x, y)``, shape ``(m, 3)``, times increasing.

    Returns
    -------
    flight
        At the times of an aircraft that keeps its airspeed; at the times given, with the fault, if those are others.
    """
    if timed.constant_wind is None:
        return _flown_in_changing_wind(timed, given)
    steps, taken = np.diff(given[:, 1:], axis=0), np.diff(given[:, 0])
    lengths = np.hypot(*steps.T)
    waits = lengths == 0.0
    needed = taken.copy()
    needed[~waits] = lengths[~waits] / ground_speeds(steps[~waits], timed.constant_wind, timed.speed)
    times = given[0, 0] + np.append(0.0, np.cumsum(needed))
    faults = _faults(timed, given, times, needed)
    rows = given
    if not faults:
        rows = np.column_stack([snapped(times, timed.events), given[:, 1:]])
    faults += _waiting_faults(timed, rows)
    pieces, legs = split_at(rows, timed.events)
    slabs = np.searchsorted(timed.events, pieces[:-1, 0], side="right")
    air = np.hypot(*(steps - np.diff(rows[:, 0])[:, None] * np.array(timed.constant_wind)).T)
    return TimedFlight(
        rows,
        pieces,
        legs,
        slabs,
        gathered(timed, pieces[:-1], pieces[1:], waits[legs], slabs),
        float(air[~waits].sum()),
        float(np.diff(rows[:, 0])[waits].sum()),
        tuple(faults),
    )


def _faults(timed: TimedMap, given: FloatArray, times: FloatArray, needed: FloatArray) -> list[str]:
    """Return which leg first takes another time than a flight, if any."""
    elapsed = given[:, 0] - given[0, 0]
    off = np.nonzero(~(np.abs(times - given[:, 0]) <= TIME_TOLERANCE * elapsed + 2.0 * np.spacing(np.abs(times))))[0]
    if not len(off):
        return []
    leg = int(off[0]) - 1
    if not 0.0 < needed[leg] < math.inf:
        return [f"leg {leg} cannot be flown: the wind is too strong for airspeed {timed.speed:g}"]
    taken = given[leg + 1, 0] - given[leg, 0]
    return [f"leg {leg} takes {taken:.9g}, and at airspeed {timed.speed:g} it takes {needed[leg]:.9g}"]


def _waiting_faults(timed: TimedMap, rows: FloatArray) -> list[str]:
    """Return why it may not wait where it does first, if it does."""
    found: list[str] = []
    for leg in np.nonzero((np.diff(rows[:, 1:], axis=0) == 0.0).all(axis=1))[0]:
        if timed.waiting is None:
            return [f"leg {leg} waits, and waiting has no price"]
        # (from one event to the next, the wind changes linearly, and its speed is convex)
        times = split_at(rows[leg : leg + 2], timed.events)[0][:, 0]
        wind = max(float(np.hypot(*timed.wind_at(rows[leg, 1:], time))) for time in times)
        if wind > timed.speed:
            return [f"leg {leg} waits in a wind of {wind:.6g}, which is faster than the airspeed {timed.speed:g}"]
    return found


def gathered(timed: TimedMap, firsts: FloatArray, lasts: FloatArray, waits: BoolArray, slabs: IntArray) -> FloatArray:
    """Integrate the risk over pieces between rows, at constant speed, each in the slab of that number."""
    durations = lasts[:, 0] - firsts[:, 0]
    table = np.column_stack([firsts[:, 1:], lasts[:, 1:], durations])
    table[waits, 2:4] = table[waits, :2]
    risks = np.zeros(len(table))
    deeper = -math.log(timed.risk_unit)
    for number in np.unique(slabs):
        slab, here = timed.all_slabs[number], slabs == number
        begins = slab.begins if math.isfinite(slab.begins) else 0.0
        part = np.zeros(int(here.sum()))
        field = slab.field.for_weight(timed.k).kernel_field()
        piece_risks(table[here], firsts[here, 0] - begins, slab.threats, field, deeper, part)
        risks[here] = part
    if timed.risk_per == "time":
        paces = durations / np.where(waits, durations, np.hypot(*(table[:, 2:4] - table[:, :2]).T))
        return risks * paces
    return risks * np.where(waits, timed.speed, 1.0)


def flown_leg(timed: TimedMap, begins: float, leg: FloatArray, *, with_risk: bool) -> tuple[FloatArray, FloatArray]:
    """
    Fly along one leg in wind on a grid.

    Parameters
    ----------
    timed
        The map and the aircraft.
    begins
        When the leg begins.
    leg
        Where it begins and ends, shape ``(2, 2)``.
    with_risk
        Whether the risk is integrated.

    Returns
    -------
    pieces, risks
        Rows between events, and the risk of each piece; the last time is infinite if the wind is too strong.
    """
    length = float(np.hypot(*(leg[1] - leg[0])))
    line = np.append(leg[0], (leg[1] - leg[0]) / length)
    progress = np.array([0.0, begins, 0.0])
    rows, risks = [[begins, *leg[0]]], []
    per_time = timed.risk_per == "time"
    stops = np.linspace(0.0, length, PIECES + 1) if timed.others else np.array([length])
    while progress[0] < length and math.isfinite(progress[1]):
        slab = timed.slab_at(progress[1])
        still = slab.field if with_risk else RiskField()
        threats = slab.threats if with_risk else slab.threats[:0]
        since = slab.begins if math.isfinite(slab.begins) else 0.0
        field = still.for_weight(timed.k).kernel_field()
        stop = float(stops[np.searchsorted(stops, progress[0], side="right")])
        advance(line, progress, (stop, slab.ends), since, timed.speed, timed.wind_grid.arrays, threats, field, per_time)
        place = leg[1] if progress[0] == length else leg[0] + progress[0] * line[2:]
        if still.rasters and not per_time:
            progress[2] += float(still.with_only([]).line_integral(rows[-1][1:], place))
        rows.append([progress[1], *place])
        risks.append(progress[2])
    return np.array(rows), np.diff(risks, prepend=0.0)


def _flown_in_changing_wind(timed: TimedMap, given: FloatArray) -> TimedFlight:
    rows, pieces, legs, risks = [given[0]], [given[:1]], [], []
    air, waited = 0.0, 0.0
    needed = np.full(len(given) - 1, math.inf)
    for number, (first, last) in enumerate(pairwise(given)):
        begins = rows[-1][0]
        if (first[1:] == last[1:]).all():
            needed[number] = last[0] - first[0]
            waited += needed[number]
            ends = np.array([[begins, *first[1:]], [begins + needed[number], *first[1:]]])
            part = split_at(ends, timed.events)[0]
            slabs = np.searchsorted(timed.events, part[:-1, 0], side="right")
            here = gathered(timed, part[:-1], part[1:], np.ones(len(slabs), dtype=np.bool_), slabs)
        else:
            part, here = flown_leg(timed, begins, np.stack([first[1:], last[1:]]), with_risk=True)
            needed[number] = part[-1, 0] - begins
            air += timed.speed * needed[number]
            if not math.isfinite(needed[number]):
                break
        ends_at = snapped(np.array([given[0, 0], part[-1, 0]]), timed.events)[1]
        part[-1, 0] = ends_at
        rows.append(np.array([ends_at, *last[1:]]))
        pieces.append(part[1:])
        risks.append(here)
        legs += [number] * len(here)
    times = np.full(len(given), math.inf)
    times[: len(rows)] = [row[0] for row in rows]
    faults = _faults(timed, given, times, needed)
    if len(rows) < len(given):
        # (the rest cannot be flown: nothing of the whole is known)
        air, risks = math.nan, [*risks, np.array([math.nan])]
        rows = list(given)
    whole = np.vstack(pieces)
    return TimedFlight(
        np.array(rows),
        whole,
        np.array(legs, dtype=np.int64),
        np.searchsorted(timed.events, whole[:-1, 0], side="right"),
        np.concatenate([*risks, np.empty(0)]),
        air,
        waited,
        tuple(faults + _waiting_faults(timed, np.array(rows))),
    )
