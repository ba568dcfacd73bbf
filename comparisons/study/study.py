"""A study: which solvers run on which scenarios with which seeds, and within which limits."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import TOLERANCE, seeds_of
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.scenarios.scenario import Scenario

#: The seeds of a study that names none.
SEEDS = (1, 2, 3)


class Cell(NamedTuple):
    """One run to be made: names of scenario and entrant, and the seed (None for solvers that draw no numbers)."""

    scenario: str
    solver: str
    seed: int | None


@dataclass(frozen=True, eq=False)
class Study:
    """
    A comparison as it was asked for.

    Attributes
    ----------
    scenarios
        With names of their own.
    entrants
        With labels of their own.
    seeds
        Of solvers that draw random numbers.
    tolerance
        Of the lower bound of each scenario; None for no bound.
    limits
        Of each run.
    title
        What the report calls it.
    source
        The text of its file, or the command that asked for it.
    """

    scenarios: Sequence[Scenario]
    entrants: Sequence[Entrant]
    seeds: Sequence[int] = SEEDS
    tolerance: float | None = TOLERANCE
    limits: Limits = field(default_factory=Limits)
    title: str = ""
    source: str = ""

    def cells(self) -> Iterator[Cell]:
        """List the runs to be made, scenario by scenario."""
        for scenario in self.scenarios:
            for entrant in self.entrants:
                for seed in seeds_of(scenario, entrant, self.seeds):
                    yield Cell(scenario.name, entrant.label, seed)
