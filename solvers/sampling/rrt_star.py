"""RRT* of OMPL and its informed kin, over the exact segment cost."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Count, Evaluations, OmplSeed, Positive, ompl_traits
from cgla_graph.solvers.budget import Budgeted


@dataclass(frozen=True)
class RrtStar(Budgeted):
    """
    OMPL's RRT* (Karaman, Frazzoli, IJRR 30(7), 2011): an anytime tree that approaches the continuous optimum.

    Attributes
    ----------
    iterations
        Budget of samples; None: no limit. It is the default budget, so that a seed gives the same path on every
        machine.
    seconds
        Budget of time, in seconds; None: no limit. Once it ends the run, the same seed may give another path each time.
    evaluations
        Budget of segments weighed by Eq. 5; None: no limit. The budget that is used up first ends the run.
    seed
        From 1 (OMPL refuses 0) to 2^32 - 1.
    rewire_factor
        Scales the number of neighbours looked at; OMPL's default is 1.1. Below 1 the proof of optimality is void,
        yet more iterations fit into the same time.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> RrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    iterations: Count | None = 2000
    seconds: Positive | None = None
    evaluations: Evaluations | None = None
    seed: OmplSeed = 1
    rewire_factor: Positive = 1.1

    traits: ClassVar[Traits] = ompl_traits("rrt-star", "OMPL's RRT* over the same cost", anytime=True)
    #: Its class in `ompl.geometric`.
    ompl_class: ClassVar[str] = "RRTstar"
    #: Its view of the cost, in `ompl_space`, and what is set besides, by names of setters.
    objective_class: ClassVar[str] = "SegmentCost"
    fixed: ClassVar[Mapping[str, object]] = {}

    def solve(self, problem: Problem) -> Solution:
        """Grow the tree until the budget is used up."""
        from cgla_graph.solvers.sampling import ompl_run, ompl_space  # noqa: PLC0415 - needs the optional package

        build = ompl_run.builder(self.ompl_class, RewireFactor=self.rewire_factor, **self.fixed)
        objective = getattr(ompl_space, self.objective_class)
        return ompl_run.run_anytime(problem, build, self.budget, self.seed, objective)


@dataclass(frozen=True)
class InformedRrtStar(RrtStar):
    """
    OMPL's Informed RRT* (Gammell, Srinivasa, Barfoot, IROS 2014): RRT* that samples where a better path may be.

    Once it has a path of cost ``c``, it samples in the ellipse with foci at start and goal whose points lie on paths of
    length at most ``c``. Where risk makes the cost far greater than the length, the ellipse covers the map and nothing
    is gained. OMPL draws from the map and rejects samples outside; after 1000 of them, it adds no sample in this
    iteration.

    OMPL's pruning of the tree is off, as it is in that paper: it takes the cost of the straight segment from the start
    for a bound, and with risk, a way around costs less.

    Attributes
    ----------
    iterations, seconds, evaluations, seed, rewire_factor
        As for `RrtStar`. Informed RRT* also ends when its path is as short as the straight line, or hardly a sample
        could improve it.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> InformedRrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = ompl_traits("informed-rrt-star", "OMPL's Informed RRT* over the same cost", anytime=True)
    ompl_class: ClassVar[str] = "InformedRRTstar"
    objective_class: ClassVar[str] = "PruningCost"
    fixed: ClassVar[Mapping[str, object]] = {"TreePruning": False, "NumSamplingAttempts": 1000}


@dataclass(frozen=True)
class SorrtStar(InformedRrtStar):
    """
    OMPL's SORRT* (Gammell, Srinivasa, Barfoot, ICRA 2015): Informed RRT* that takes its samples sorted.

    It draws batches and goes through each in the order of the length of the way over the sample, so that the samples
    which may help most come first.

    Attributes
    ----------
    iterations, seconds, evaluations, seed, rewire_factor
        As for `InformedRrtStar`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> SorrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = ompl_traits("sorrt-star", "OMPL's SORRT* over the same cost", anytime=True)
    ompl_class: ClassVar[str] = "SORRTstar"
