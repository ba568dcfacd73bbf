"""Planning step by step: solvers that decide where to go next, and remember, instead of planning a whole path."""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

from cgla_graph._types import FloatArray

if TYPE_CHECKING:
    from cgla_graph.model.problem import Problem


@dataclass(frozen=True, eq=False)
class Move:
    """
    What a solver decided for one step.

    Attributes
    ----------
    path
        Waypoints from where the UAV is, shape ``(m, 2)``, map units, together no longer than a step. The last step may
        end at the goal before its length is used up.
    memory
        What the solver wants to be handed back at its next step.
    stuck
        Why there is no further step, in one line; empty where there is one.
    """

    path: FloatArray
    memory: Hashable
    stuck: str = ""


@runtime_checkable
class StepByStep(Protocol):
    """A solver of the plane that a mission asks for one step a tick, on what its UAV knows then."""

    traits: ClassVar[Any]

    def move(self, problem: "Problem", memory: Hashable | None, step: float) -> Move:
        """
        Decide one step.

        Parameters
        ----------
        problem
            What is known; its start is where the UAV is.
        memory
            Of the last move; None before the first.
        step
            How far to go, map units.
        """
        ...
