"""BIT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Count, Evaluations, OmplSeed, Positive, Whole, ompl_traits
from cgla_graph.solvers.budget import Budgeted


@dataclass(frozen=True)
class BitStar(Budgeted):
    """
    OMPL's BIT* (Gammell, Barfoot, Srinivasa, IJRR 39(5), 2020): batches of samples, searched like by A*.

    The lengths of segments are its heuristic, so that it weighs few segments; where risk makes the cost far greater
    than the length, it looks at many edges before it weighs one. Once it has a path, it samples in the ellipse of
    `InformedRrtStar`.

    Attributes
    ----------
    iterations
        Budget of steps of its queue; None: no limit. It is the default budget, so that a seed gives the same path on
        every machine.
    seconds, evaluations, seed, rewire_factor
        As for `RrtStar`. BIT* also ends when its path is as short as the straight line, or hardly a sample could
        improve it.
    samples_per_batch
        Samples of a batch, at least 1.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> BitStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    iterations: Count | None = 20_000
    seconds: Positive | None = None
    evaluations: Evaluations | None = None
    seed: OmplSeed = 1
    samples_per_batch: Annotated[int, Whole(1, 1_000_000)] = 100
    rewire_factor: Positive = 1.1

    traits: ClassVar[Traits] = ompl_traits("bit-star", "OMPL's BIT* over the same cost", anytime=True)

    def solve(self, problem: Problem) -> Solution:
        """Search batch after batch until the budget is used up."""
        from cgla_graph.solvers.sampling import ompl_run, ompl_space  # noqa: PLC0415 - needs the optional package

        build = ompl_run.builder("BITstar", SamplesPerBatch=self.samples_per_batch, RewireFactor=self.rewire_factor)
        cost = partial(ompl_space.PruningCost, samples_per_batch=self.samples_per_batch)
        return ompl_run.run_anytime(problem, build, self.budget, self.seed, cost)
