"""A study: which solvers run on which scenarios with which seeds, and within which limits."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from cgla_graph._display import NotebookRepr
from cgla_graph._lazy import function_above
from cgla_graph.comparisons.study.entrant import Entrant, as_entrant, check_domain
from cgla_graph.comparisons.study.flight_run import ComparedMission
from cgla_graph.comparisons.study.metric import Metric, as_metric
from cgla_graph.comparisons.study.rows import EXPORTED
from cgla_graph.comparisons.study.runner import seeds_of
from cgla_graph.errors import StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.solution import TOLERANCE
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, as_any_scenario
from cgla_graph.scenarios.mission_file import MissionFile

#: The seeds of a study that names none.
SEEDS = (1, 2, 3)


class Cell(NamedTuple):
    """One run to be made: names of scenario and entrant, and the seed (None for solvers that draw no numbers)."""

    scenario: str
    solver: str
    seed: int | None


class FlightCell(NamedTuple):
    """One flight to be made: names of mission, variant and entrant, and the seed (None as in `Cell`)."""

    mission: str
    variant: str
    solver: str
    seed: int | None


@dataclass(frozen=True, eq=False)
class Study(NotebookRepr):
    """
    The request of a comparison.

    Attributes
    ----------
    scenarios
        With distinct names, in the plane or pairs of nodes of graphs (`cgla_graph.comparisons.graph_pairs`). A
        `Problem` or `GraphProblem` is named after its position; a text is a name or a path.
    entrants
        With distinct labels; a text is read by `Entrant.parse`.
    seeds
        Of solvers that draw random numbers.
    tolerance
        Of the lower bound of each scenario; None for no bound.
    limits
        Of each run.
    title
        Its title in the report.
    source
        The text of its file, or the command.
    missions, mission_entrants
        Missions with distinct names, and the entrants that fly them.
    metrics
        With distinct names, computed of each path: functions of a path (on a graph its nodes) and a problem (see
        `cgla_graph.comparisons.metric`).
    """

    scenarios: Sequence[AnyScenario]
    entrants: Sequence[Entrant]
    seeds: Sequence[int] = SEEDS
    tolerance: float | None = TOLERANCE
    limits: Limits = field(default_factory=Limits)
    title: str = ""
    source: str = ""
    missions: Sequence[MissionFile] = ()
    mission_entrants: Sequence[Entrant] = ()
    metrics: Sequence[Metric] = ()

    def __post_init__(self) -> None:
        """Turn problems and names into scenarios and entrants."""
        scenarios = [as_any_scenario(given, f"problem-{at}") for at, given in enumerate(self.scenarios, start=1)]
        object.__setattr__(self, "scenarios", scenarios)
        object.__setattr__(self, "entrants", [as_entrant(given) for given in self.entrants])
        check_domain(self.scenarios, self.entrants)
        metrics = [as_metric(given) for given in self.metrics]
        taken = [one.name for one in metrics if one.name in {column.key for column in EXPORTED}]
        if taken:
            msg = f"the metric {taken[0]!r} has the name of a column; give it another, as @metric(name=…)"
            raise StudyError(msg)
        object.__setattr__(self, "metrics", metrics)

    def _repr_html_(self) -> str:
        """Return the fields as a table, beside the map of the first scenario."""
        first = self.scenarios[0].problem if self.scenarios else None
        return str(function_above("html")(self, first))

    def cells(self) -> Iterator[Cell]:
        """List the runs to be made, scenario by scenario."""
        for scenario in self.scenarios:
            for entrant in self.entrants:
                for seed in seeds_of(scenario, entrant, self.seeds):
                    yield Cell(scenario.name, entrant.label, seed)

    def flights(self) -> Iterator[FlightCell]:
        """List the flights to be made, mission by mission."""
        return flight_cells(self.missions, self.mission_entrants, self.seeds)


def flight_cells(
    missions: Iterable[MissionFile | ComparedMission], entrants: Sequence[Entrant], seeds: Sequence[int]
) -> Iterator[FlightCell]:
    """List every flight of missions with all their variants, by entrants with these seeds."""
    for mission in missions:
        for variant in mission.variants:
            for entrant in entrants:
                for seed in seeds_of(None, entrant, seeds):
                    yield FlightCell(mission.name, variant, entrant.label, seed)
