"""Flights of a comparison: one solver on one variant of a mission, as rows and as tables."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console
from cgla_graph.comparisons.missions.files import plain_json, team_totals
from cgla_graph.comparisons.numbers import duration, figure
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.scenarios.mission_file import MissionFile

#: The columns of `flights.jsonl` and `flights.csv`, one row a flight.
COLUMNS = (
    "mission",
    "variant",
    "solver",
    "seed",
    "status",
    "arrived",
    "uavs",
    "cost",
    "length",
    "risk",
    "risk_sum",
    "least_separation",
    "ticks",
    "replans",
    "planning_seconds",
    "message",
)
#: What a narrow terminal does without, the first first.
_SPARE = ("risk sum", "replans", "ticks", "risk", "length", "planning")


@dataclass(frozen=True, eq=False)
class FlightRun:
    """
    One solver's flight of one variant of a mission.

    Attributes
    ----------
    mission, variant
        The names.
    solver
        The entrant's label.
    seed
        For seeded solvers; else None.
    n_uavs
        How many UAVs there are.
    status
        ``arrived`` if all did, else how the first that did not ended; ``unavailable`` or ``failed`` where nothing flew.
    flown
        The flight; None where nothing flew.
    message
        Why, if not all arrived.
    """

    mission: str
    variant: str
    solver: str
    seed: int | None
    n_uavs: int
    status: str
    flown: MissionRun | None = None
    message: str = ""

    @property
    def all_arrived(self) -> bool:
        """Whether every UAV reached its goal."""
        return self.flown is not None and self.flown.flight.all_arrived

    def row(self) -> dict[str, Any]:
        """Return one value for each of `COLUMNS`; numbers that do not exist are None."""
        row: dict[str, Any] = dict.fromkeys(COLUMNS)
        row |= {"mission": self.mission, "variant": self.variant, "solver": self.solver, "seed": self.seed}
        row |= {"status": self.status, "uavs": self.n_uavs, "message": self.message}
        if self.flown is not None:
            flight = self.flown.flight
            uavs = flight.uavs.values()
            row |= {
                "arrived": self.flown.n_arrived,
                **team_totals(flight),
                "least_separation": flight.least_separation,
                "ticks": flight.ticks,
                "replans": sum(len(uav.replans) for uav in uavs),
                "planning_seconds": math.fsum(uav.planning_seconds for uav in uavs),
            }
        found: dict[str, Any] = plain_json(row)
        return found


@dataclass
class FlightRuns:
    """
    The flights of a comparison so far.

    Attributes
    ----------
    runs
        The flights.
    written
        The files.
    interrupted
        Whether Ctrl-C ended it.
    """

    runs: list[FlightRun] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    interrupted: bool = False


def print_flight_runs(missions: Sequence[MissionFile], runs: Sequence[FlightRun]) -> None:
    """Print a table a variant, the cheapest solver first; and why solvers did not fly, or not all UAVs arrived."""
    for mission in missions:
        for variant in mission.variants:
            of_variant = [run for run in runs if (run.mission, run.variant) == (mission.name, variant)]
            if of_variant:
                console.out_table(flights_table(mission, variant, of_variant))


def flights_table(mission: MissionFile, variant: str, runs: Sequence[FlightRun]) -> FittedTable:
    """Show the flights of one variant: a line a flight, the cheapest first."""
    unit = "m" if mission.projection else "map units"
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
            "-" if run.flown is None else f"{row['arrived']}/{row['uavs']}",
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
    title = f"{name}: {mission.title or 'a mission'} (lengths in {unit})"
    return FittedTable(title, ("solver", "status"), heads, _SPARE, notes, rows)


def _figure(value: float | None, digits: int) -> str:
    return "-" if value is None else figure(value, digits)


def _place(run: FlightRun) -> tuple[float, int, float]:
    """Sort flights: the cheapest first; then those with a UAV that did not arrive, the most arrivals first."""
    row = run.row()
    cost = row["cost"] if row["cost"] is not None else math.inf
    arrived = -1 if row["arrived"] is None else row["arrived"]
    return float(f"{cost:.9g}"), -arrived, row["planning_seconds"] or 0.0
