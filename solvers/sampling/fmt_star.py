"""FMT* and BFMT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import Any, ClassVar

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import LARGEST_SEED, ompl_traits, whole_setting
from cgla_graph.solvers.budget import Budget


@dataclass(frozen=True)
class FmtStar:
    """
    OMPL's FMT* (Janson, Schmerling, Clark, Pavone, IJRR 34(7), 2015): one sweep over one set of samples.

    Attributes
    ----------
    samples
        Size of the set, at least 1; it is all drawn before the search, and no more afterwards.
    seconds, evaluations
        Hard stops: time in seconds, and segments weighed by Eq. 5; None: no limit. A sweep that is stopped has found
        nothing.
    seed
        From 1 (OMPL refuses 0) to 2^32 - 1.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> FmtStar(samples=200, seed=1).solve(problem).status.label
    'found'
    """

    samples: int = 1000
    seconds: float | None = None
    evaluations: int | None = None
    seed: int = 1

    traits: ClassVar[Traits] = ompl_traits("fmt-star", "OMPL's FMT* over the same cost")

    def __post_init__(self) -> None:
        """Check the settings."""
        whole_setting(self.traits.name, "samples", self.samples, at_least=1)
        Budget(self.samples, self.seconds, self.evaluations).check(self.traits.name, "samples")
        whole_setting(self.traits.name, "seed", self.seed, at_least=1, at_most=LARGEST_SEED)

    def solve(self, problem: Problem) -> Solution:
        """Draw the samples and sweep over them once."""
        from cgla_graph.solvers.sampling import ompl_run  # noqa: PLC0415 - needs the optional package

        limits = Budget(seconds=self.seconds, evaluations=self.evaluations)
        return ompl_run.run_once(problem, self._planner, limits, self.seed)

    def _planner(self, si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        from ompl import geometric as og  # noqa: PLC0415 - optional

        return self._sized(og.FMT(si))

    def _sized(self, planner: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        planner.setNumSamples(self.samples)
        # "extended" goes on sampling, without end if the goal is walled in
        planner.setExtendedFMT(False)
        return planner


@dataclass(frozen=True)
class BfmtStar(FmtStar):
    """
    OMPL's BFMT* (Starek, Gomez, Schmerling, Janson, Moreno, Pavone, IROS 2015): FMT* from both ends.

    Attributes
    ----------
    samples, seconds, evaluations, seed
        As for `FmtStar`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> BfmtStar(samples=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = ompl_traits("bfmt-star", "OMPL's BFMT* over the same cost")

    def _planner(self, si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        from ompl import geometric as og  # noqa: PLC0415 - optional

        return self._sized(og.BFMT(si))
