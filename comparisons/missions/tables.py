"""Tables of flights for the terminal: a line a UAV, and a line a variant."""

import math
from collections.abc import Callable, Mapping, Sequence

from cgla_graph._text import at_most_percent, duration, figure
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.mission.records import EXPOSED_ABOVE, Flight, MissionStatus, UavFlight
from cgla_graph.mission.world import TimedThreat
from cgla_graph.people.units import rate_text, risk_unit

#: The columns of `flight_table`, and those of `variants_table`.
_COLUMNS: Mapping[str, Callable[[UavFlight], str]] = {
    "ticks": lambda uav: str(uav.ended - uav.departed),
    "length": lambda uav: figure(uav.length, 6),
    "risk": lambda uav: figure(uav.risk, 4),
    "risk sum": lambda uav: figure(uav.risk_sum, 4),
    "max F": lambda uav: figure(uav.max_risk, 3),
    "exposure": lambda uav: figure(uav.exposure, 3),
    "replans": lambda uav: str(len(uav.replans)),
    "known": lambda uav: str(len(uav.knowledge_at(uav.ended).threats) + len(uav.knowledge_at(uav.ended).areas)),
    "cost": lambda uav: figure(uav.cost, 6),
}
_TEAM_COLUMNS: Mapping[str, Callable[[MissionRun], str]] = {
    "arrived": lambda flown: f"{flown.n_arrived}/{len(flown.flight.uavs)}",
    "ticks": lambda flown: str(flown.flight.ticks),
    "least separation": lambda flown: figure(flown.flight.least_separation, 4),
    "length": lambda flown: figure(flown.flight.totals["length"], 6),
    "risk": lambda flown: figure(flown.flight.totals["risk"], 4),
    "risk sum": lambda flown: figure(flown.flight.totals["risk_sum"], 4),
    "cost": lambda flown: figure(flown.flight.cost, 6),
    "replans": lambda flown: str(sum(len(uav.replans) for uav in flown.flight.uavs.values())),
}
#: Columns that a narrow terminal drops, in order.
_SPARE = ("exposure", "known", "max F", "risk sum", "replans", "ticks", "risk")
_SPARE_OF_VARIANTS = ("risk sum", "replans", "ticks", "risk", "length")


def heading(flown: MissionRun) -> str:
    """Name a mission in one line."""
    lengths = "map units" if flown.projection is None else "metres"
    return f"{flown.name}: {flown.title or 'a mission'} (lengths in {lengths})"


def flight_table(flown: MissionRun) -> FittedTable:
    """Show one flight: a line a UAV."""
    words: dict[str, Callable[[UavFlight], str]] = {"UAV": lambda uav: uav.name, "status": lambda uav: uav.status.label}
    return FittedTable.of(flown.variant or flown.name, flown.flight.uavs.values(), words, _COLUMNS, _SPARE)


def flight_notes(flown: MissionRun) -> list[str]:
    """Say what stands below the table of a flight: who planned, how near UAVs came, and why some did not arrive."""
    # of those in a livelock, one line says all that there is to say
    told = (MissionStatus.ARRIVED, MissionStatus.LIVELOCK)
    remarks = [
        f"{uav.name}: {uav.status.value}{f': {uav.message}' if uav.message else ''}"
        for uav in flown.flight.uavs.values()
        if uav.status not in told
    ]
    remarks += [f"{uav.name}: {uav.remark}" for uav in flown.flight.uavs.values() if uav.remark]
    near = [closest_note(flown)] if len(flown.flight.uavs) > 1 else []
    field = flown.mission.world.field
    unit_of_risk = risk_unit(field)
    units = [f"risk: in {unit_of_risk}"] if unit_of_risk else []
    moving = any(isinstance(one, TimedThreat) for one in flown.mission.world.timed)
    rates = {} if moving else {one.name: rate_text(field, one.risk, one.length) for one in flown.flight.uavs.values()}
    units += [f"{name}: {rate}" for name, rate in rates.items() if rate]
    return [
        rules_note(flown),
        *units,
        *near,
        *_worth_lines(flown),
        *_warnings(flown),
        *_livelock_lines(flown),
        *remarks,
    ]


def _livelock_lines(flown: MissionRun) -> list[str]:
    """Say who flies in circles, since when, and how long a circle is."""
    livelock = flown.flight.livelock
    if livelock is None:
        return []
    names = [uav.name for uav in flown.flight.uavs.values() if uav.status is MissionStatus.LIVELOCK]
    circle = f"the state of tick {livelock.since} came back; it repeats every {livelock.period} ticks without end"
    return [f"livelock: {circle}: {', '.join(names)}"]


def _warnings(flown: MissionRun) -> list[str]:
    """Say who took off late or inside a threat, and around whom something came up."""
    lines = []
    for event in flown.flight.events:
        if event.kind == "delayed":
            lines.append(f"{event.uav}: waits for its take-off at tick {event.tick}: {event.hindrance}")
        elif event.kind == "started-in-risk":
            lines.append(f"{event.uav}: starts inside threat {event.detail['threat']}, F = {event.detail['risk']:.3g}")
        elif event.kind == "appeared-on":
            ((what, number),) = [(name, event.detail[name]) for name in ("threat", "area") if name in event.detail]
            lines.append(f"{event.uav}: {what} {number} came up around it at tick {event.tick}")
    return lines


#: Explanations of the columns of `flight_table`.
COLUMN_NOTES = (
    f"risk sum: F added up over ticks (the paper's measure); exposure: the length with F over {EXPOSED_ABOVE:g}",
    "replans: the plan of take-off is the first; known: threats and areas that it believed in at the end",
)


def rules_note(flown: MissionRun) -> str:
    """Say in one line who planned, by which rules."""
    mission = flown.mission
    weights = sorted({uav.k for uav in mission.uavs})
    k = ", ".join(f"{weight:g}" for weight in weights[:4]) + (", …" if len(weights) > 4 else "")  # noqa: PLR2004 - one line
    sharing = mission.sharing
    if not sharing.is_on:
        shared = "none"
    else:
        limits = {"radius": sharing.radius, "delay": sharing.delay, "loss": sharing.loss}
        shared = " ".join(f"{name}={value:g}" for name, value in limits.items() if value) or "global"
    rule = mission.virtual_obstacle
    obstacle = "none" if rule is None else f"stepnum={rule.stepnum}"
    seconds = math.fsum(uav.planning_seconds for uav in flown.flight.uavs.values())
    return (
        f"solver: {flown.solver}; k: {k}; sharing: {shared}; virtual obstacles: {obstacle}; "
        f"avoidance: {mission.avoidance}; {flown.flight.ticks} ticks in {duration(flown.seconds)}, "
        f"{duration(seconds)} of them planning"
    )


def closest_note(flown: MissionRun) -> str:
    """Say in one line how near two UAVs came to each other."""
    pair = flown.flight.closest
    if pair is None:
        return "least separation: no two UAVs were in the air together outside their terminal discs"
    x, y = pair.where
    if flown.projection is None:
        where = f"({x:.4g}, {y:.4g})"
    else:
        east, north = flown.projection.inverse((x, y)).tolist()
        where = f"longitude {east:.5g}, latitude {north:.5g}"
    safe = max(uav.safe_distance for uav in flown.mission.uavs if uav.name in (pair.first, pair.second))
    if pair.distance < flown.mission.collision_distance:
        near = " (closer than the collision distance)"
    else:
        near = f" (closer than the safe distance, {safe:.4g}{flown.unit})" if pair.distance < safe else ""
    return (
        f"least separation: {figure(pair.distance, 4)}{flown.unit}{near}, of {pair.first} and {pair.second}, "
        f"at tick {pair.time:.4g}, near {where}"
    )


def _worth_lines(flown: MissionRun) -> list[str]:
    """Say what not knowing cost each UAV, and what sharing was worth; nothing that was not asked for."""
    lines = []
    if flown.ignorance is not None:
        lines.append(f"price of ignorance (cost over that with full knowledge): {_ratios(flown.ignorance)}")
    if flown.sharing is not None:
        lines.append(f"value of sharing (cost without it over cost): {_ratios(flown.sharing)}")
    if flown.bounds is not None:
        lines.append(_bound_line(flown.flight, math.fsum(flown.bounds.values()), flown.unit))
    return lines


def _bound_line(flight: Flight, least: float, unit: str) -> str:
    """Say what the team pays at least, and how near it came."""
    if math.isnan(least):
        return "lower bound: none, as a threat peaks above 1"
    # (a sum of costs may round to less than that of the bounds)
    most = at_most_percent(round(max(flight.gap, 0.0), 9))
    over = f"; the flown paths cost at most {most} more" if flight.all_arrived else ""
    return (
        f"lower bound (full knowledge, each UAV alone, what changes left out): {figure(least, 6)}{unit} together{over}"
    )


def _ratios(ratios: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {'∞' if value == math.inf else figure(value, 4)}x" for name, value in ratios.items())


def variants_table(flights: Sequence[MissionRun]) -> FittedTable:
    """Show the variants of a mission beside each other: a line a variant."""
    title = f"{flights[0].name}: all variants, all UAVs together"
    return FittedTable.of(title, flights, {"variant": lambda flown: flown.variant}, _TEAM_COLUMNS, _SPARE_OF_VARIANTS)
