"""Flights of a comparison as tables: a line a flight, the cheapest first."""

import math
from collections.abc import Sequence

from cgla_graph.comparisons import console
from cgla_graph.comparisons.numbers import duration, figure
from cgla_graph.comparisons.study.flight_run import ComparedMission, FlightRun
from cgla_graph.comparisons.tables.fitted_table import FittedTable

#: What a narrow terminal does without, the first first.
_SPARE = ("risk sum", "replans", "ticks", "risk", "length", "planning")


def print_flight_runs(missions: Sequence[ComparedMission], runs: Sequence[FlightRun]) -> None:
    """Print a table a variant, the cheapest solver first; and why solvers did not fly, or not all UAVs arrived."""
    for mission in missions:
        for variant in mission.variants:
            of_variant = [run for run in runs if (run.mission, run.variant) == (mission.name, variant)]
            if of_variant:
                console.out_table(flights_table(mission, variant, of_variant))


def flights_table(mission: ComparedMission, variant: str, runs: Sequence[FlightRun]) -> FittedTable:
    """Show the flights of one variant: a line a flight, the cheapest first."""
    name = f"{mission.name}, {variant}" if variant else mission.name
    heads = (
        "seed",
        "arrived",
        "cost",
        "length",
        "risk",
        "risk sum",
        "least separation",
        "ticks",
        "replans",
        "planning",
    )
    remarks = []
    rows: list[Sequence[str]] = []
    for run in sorted(runs, key=_place):
        row = run.row()
        seconds = row["planning_seconds"]
        cells = [
            run.solver,
            run.status,
            "-" if run.seed is None else str(run.seed),
            "-" if row["arrived"] is None else f"{row['arrived']}/{row['uavs']}",
            _figure(row["cost"], 6),
            _figure(row["length"], 6),
            _figure(row["risk"], 4),
            _figure(row["risk_sum"], 4),
            _figure(row["least_separation"], 4),
            "-" if row["ticks"] is None else str(row["ticks"]),
            "-" if row["replans"] is None else str(row["replans"]),
            "-" if seconds is None else duration(seconds),
        ]
        rows.append(cells)
        if run.message:
            remarks.append(f"{run.solver}: {run.message}")
    notes = [
        "cost, length, risk: of all UAVs together; the cost only where all arrive",
        "least separation: outside terminal discs; planning: of all UAVs, all replans",
        *dict.fromkeys(remarks),
    ]
    title = f"{name}: {mission.title or 'a mission'} (lengths in {mission.unit})"
    return FittedTable(title, ("solver", "status"), heads, _SPARE, notes, rows)


def _figure(value: float | None, digits: int) -> str:
    return "-" if value is None else figure(value, digits)


def _place(run: FlightRun) -> tuple[float, int, float]:
    """Sort flights: the cheapest first; then those with a UAV that did not arrive, the most arrivals first."""
    row = run.row()
    cost = row["cost"] if row["cost"] is not None else math.inf
    arrived = -1 if row["arrived"] is None else row["arrived"]
    return float(f"{cost:.9g}"), -arrived, row["planning_seconds"] or 0.0
