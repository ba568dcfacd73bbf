"""The moment of a flight that its picture shows: when two UAVs were closest, or one had to plan again."""

from collections.abc import Sequence

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.mission.records import UavFlight

_MOST_MARKS = 30  # marks on the longest trace, about


def telling_tick(view: MissionRun) -> float:
    """
    Return the moment that a picture shows: of the closest approach.

    Where no two UAVs meet, the last tick at which one made a new plan on the way.
    """
    pair = view.closest
    if pair is not None:
        return pair.time
    replans = [tick for uav in view.flight.uavs.values() for tick in uav.replans if tick > uav.departed]
    return float(max(replans, default=0))


def place_at(uav: UavFlight, time: float) -> Point | None:
    """
    Return where a UAV was at a time between ticks, map units; None on the ground.

    Parameters
    ----------
    uav
        Its flight.
    time
        In ticks.
    """
    if not uav.took_off or not uav.departed <= time <= uav.ended:
        return None
    x, y = (float(np.interp(time, uav.times, uav.path[:, axis])) for axis in (0, 1))
    return x, y


def mark_spacing(view: MissionRun) -> int:
    """
    Return every how many ticks a trace is marked: 10, or where that were too many a rounder number.

    Parameters
    ----------
    view
        The flight.
    """
    longest = max(uav.ended - uav.departed for uav in view.flight.uavs.values())
    return next((step for step in (10, 20, 50, 100, 200, 500, 1000) if longest <= _MOST_MARKS * step), 10_000)


def shown_at(view: MissionRun, moment: float) -> list[tuple[int, UavFlight, Point]]:
    """List the UAVs that have circles: the closest pair, or where there is none, the one that made a new plan."""
    pair = view.closest
    shown = []
    for number, uav in enumerate(view.flight.uavs.values()):
        place = place_at(uav, moment)
        wanted = uav.name in {pair.first, pair.second} if pair else moment in uav.replans
        if place is not None and wanted:
            shown.append((number, uav, place))
    return shown


def obstacles_at(uav: UavFlight, moment: float) -> Sequence[FloatArray]:
    """Return the virtual obstacles a UAV planned around, ``(x, y, spread)`` each."""
    return [np.array([o.x, o.y, o.spread]) for o in uav.obstacles_at(int(moment))]
