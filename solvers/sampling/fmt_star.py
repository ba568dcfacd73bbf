"""FMT* and BFMT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import ClassVar

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Count, Evaluations, OmplSeed, Positive, Settings, ompl_traits
from cgla_graph.solvers.budget import Budget


@dataclass(frozen=True)
class FmtStar(Settings):
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

    samples: Count = 1000
    seconds: Positive | None = None
    evaluations: Evaluations | None = None
    seed: OmplSeed = 1
    #: Its class in `ompl.geometric`.
    ompl_class: ClassVar[str] = "FMT"

    traits: ClassVar[Traits] = ompl_traits("fmt-star", "OMPL's FMT* over the same cost")

    def solve(self, problem: Problem) -> Solution:
        """Draw the samples and sweep over them once."""
        from cgla_graph.solvers.sampling import ompl_run  # noqa: PLC0415 - needs the optional package

        limits = Budget(seconds=self.seconds, evaluations=self.evaluations)
        # "extended" goes on sampling, without end if the goal is walled in
        build = ompl_run.builder(self.ompl_class, NumSamples=self.samples, ExtendedFMT=False)
        return ompl_run.run_once(problem, build, limits, self.seed)


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
    ompl_class: ClassVar[str] = "BFMT"
