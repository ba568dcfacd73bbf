"""Fuzzy steering straight to the goal: in the style of FBCRI."""

from dataclasses import dataclass
from typing import ClassVar

from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import reactive_traits
from cgla_graph.solvers.reactive.fuzzy_steering import FuzzyMemory, FuzzySteering
from cgla_graph.solvers.reactive.step_by_step import Surroundings


@dataclass(frozen=True)
class FbcriStyle(FuzzySteering[FuzzyMemory]):
    """
    Fuzzy steering with feedback, in the style of FBCRI.

    Of the original (Zheng, Wu, Liu and Cai, Applied Soft Computing 11, 2011, 1241-1255) the abstract is public: a
    feedback is embedded in the compositional rule of inference, and one of the uses is path planning of UAVs in real
    time. The paper on CGLA adds that new rules are generated and put into the rule base, that a virtual obstacle or
    target prevents non-convergence, and that the first rules are selected by hand. Neither its rules nor its code are
    public: this is **not** the original.

    The sets, the 75 rules and the feedback are our design. Clearance from the nearest threat (from its contour of two
    spreads), the direction of that threat and the direction of the aim are blurred into fuzzy sets; the turn, at most
    60 degrees, is the centroid of their composition with the rules. The step is simulated: where risk rises by more
    than `tolerance`, a rule is written that turns one label further away from the threat, and after five steps away
    from the aim, one label back towards it; it holds for about these inputs, by half, and the inference is made again,
    at most three times. Thirty written rules are remembered. After `stall` steps without headway, a virtual target 0.2
    of the side away, the first free one 30 to 150 degrees off the aim, is flown to instead, and others on the same
    side after it, until the aim is free and nearer than where it began.

    A no-fly area counts as a threat where it is nearest; a step that would cross it is turned aside by as little as
    possible. A threat around the target does not count: it has to be entered. Other UAVs of a mission are threats like
    any others, where the mission has virtual obstacles.

    Known failures: only the nearest threat counts, so that rules give way to one threat and into another where threats
    are dense; a pocket deeper than the 0.2 to a virtual target is not left; virtual targets may lead around in circles;
    nothing weighs length against risk, for any ``k``, and nothing is optimal. `Solution.evaluations` counts points
    of ``F``.

    Source: the abstract; Zhang, Mao, Liu and Liu, Automatica 50(3), 2014, Section 5.2; virtual targets as in the
    behaviour-based planners of the same group.

    Attributes
    ----------
    step, max_steps, patience
        As in `Reactive`.
    sight, tolerance, stall
        As in `FuzzySteering`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, spread=0.1)]), k=10.0)
    >>> risk = problem.evaluate(FbcriStyle().solve(problem).path).risk
    >>> risk < 0.5 * problem.evaluate([problem.start, problem.goal]).risk
    True
    """

    traits: ClassVar[Traits] = reactive_traits(
        "fbcri-style", "fuzzy rules with feedback, step by step (not the original)"
    )

    def begin(self, around: Surroundings) -> FuzzyMemory:
        """Face the goal."""
        return FuzzyMemory.at_start(around)

    def choose(self, around: Surroundings, memory: FuzzyMemory) -> FuzzyMemory:
        """Steer to the goal."""
        return self.steer(around, memory, around.problem.goal)
