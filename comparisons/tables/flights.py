"""Tables of a comparison's flights: a line a flight, the cheapest first."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from cgla_graph._text import duration, figure
from cgla_graph.comparisons import console
from cgla_graph.comparisons.study.flight_run import ComparedMission, FlightRun
from cgla_graph.comparisons.tables.fitted_table import FittedTable

#: The columns of numbers: the head, the entry of a row, and how it is written.
_COLUMNS: Sequence[tuple[str, str, Callable[[Any], str]]] = (
    ("seed", "seed", str),
    ("arrived", "arrived", str),
    ("cost", "cost", lambda value: figure(value, 6)),
    ("length", "length", lambda value: figure(value, 6)),
    ("risk", "risk", lambda value: figure(value, 4)),
    ("risk sum", "risk_sum", lambda value: figure(value, 4)),
    ("least separation", "least_separation", lambda value: figure(value, 4)),
    ("ticks", "ticks", str),
    ("replans", "replans", str),
    ("planning", "planning_seconds", duration),
)
#: Columns that a narrow terminal drops, in order.
_SPARE = ("risk sum", "replans", "ticks", "risk", "length", "planning")


def print_flights(missions: Sequence[ComparedMission], flights: Sequence[FlightRun]) -> None:
    """Print a table a variant, and why solvers did not fly, or not all UAVs arrived."""
    for mission, variant, of_variant in by_variant(missions, flights):
        console.out_table(flights_table(mission, variant, of_variant))


def by_variant(
    missions: Sequence[ComparedMission], flights: Sequence[FlightRun]
) -> Iterator[tuple[ComparedMission, str, list[FlightRun]]]:
    """Group flights by mission and variant, in the order of these, the cheapest flight first."""
    for mission in missions:
        for variant in mission.variants:
            found = [one for one in flights if (one.mission, one.variant) == (mission.name, variant)]
            if found:
                yield mission, variant, sorted(found, key=_place)


def flights_table(mission: ComparedMission, variant: str, flights: Sequence[FlightRun]) -> FittedTable:
    """Show the flights of one variant, a line each, in their order."""
    notes = [
        "cost, length, risk: of all UAVs together; the cost only where all arrive",
        "least separation: outside terminal discs; planning: of all UAVs, all replans",
        *dict.fromkeys(f"{one.solver}: {one.message}" for one in flights if one.message),
    ]
    name = f"{mission.name}, {variant}" if variant else mission.name
    title = f"{name}: {mission.title or 'a mission'} (lengths in {mission.unit})"
    rows: list[Sequence[str]] = [[one.solver, one.status, *_cells(one.row())] for one in flights]
    return FittedTable(title, ("solver", "status"), [head for head, _, _ in _COLUMNS], _SPARE, notes, rows)


def _cells(row: Mapping[str, Any]) -> Iterator[str]:
    for head, key, write in _COLUMNS:
        cell = "-" if row[key] is None else write(row[key])
        yield f"{cell}/{row['uavs']}" if head == "arrived" and cell != "-" else cell


def _place(flight: FlightRun) -> tuple[float, int, float]:
    """Sort flights: the cheapest first; then those with a UAV that did not arrive, the most arrivals first."""
    row = flight.row()
    cost = row["cost"] if row["cost"] is not None else math.inf
    arrived = -1 if row["arrived"] is None else row["arrived"]
    return float(f"{cost:.9g}"), -arrived, row["planning_seconds"] or 0.0
