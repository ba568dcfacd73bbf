"""Any solver's path, refined in the plane."""

import dataclasses
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import shown
from cgla_graph._types import Point
from cgla_graph._validate import point_array
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.model.solver import Solver, Traits
from cgla_graph.solvers import registry, solving
from cgla_graph.solvers.base import NonNegative, Resolution, Settings, Whole, settings_of


@dataclass(frozen=True)
class Refine(Settings):
    """
    Refines another solver's path, or given waypoints (`cgla_graph.refine.refine.refine_path`).

    Attributes
    ----------
    base
        A solver's name, a solver, or waypoints from start to goal, shape ``(m, 2)``, map units.
    base_seed
        The seed of a base that draws random numbers; None: its own default. Other settings: give a solver as base.
    resolution
        For a base that needs a lattice: points a side, or a `Lattice`; None: that of `solve`, else 20.
    tolerance
        End after a stage that lowers the cost by less than this, relative to it.
    max_points
        End before a stage with more waypoints than this.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError
        If there is no solver of that name, or it cannot run here.
    SolverSettingError
        If a setting is out of range, or a seed is given to a base that draws no random numbers.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> answers = Refine("eight-direction"), Refine([problem.start, (0.2, 0.8), problem.goal])
    >>> [round(answer.solve(problem).cost, 4) for answer in answers]
    [1.3516, 1.3516]
    """

    base: str | Solver | ArrayLike = "cgla"
    base_seed: int | None = None
    resolution: Resolution | None = None
    tolerance: NonNegative = 1e-6
    max_points: Annotated[int, Whole(2)] = 1000

    traits: ClassVar[Traits] = Traits(
        "refine", "another solver's path, refined in the plane", domain="plane", anytime=True, proves=True
    )

    def __post_init__(self) -> None:
        """Check the settings, and build the base once so that it checks its own."""
        super().__post_init__()
        with settings_of("refine"):
            if not isinstance(self.base, str) and not hasattr(self.base, "traits"):
                # a tuple, so that equal settings are equal
                rows = point_array("base", self.base).reshape(-1, 2).tolist()
                object.__setattr__(self, "base", tuple((x, y) for x, y in rows))
        if self.base == self.traits.name:
            msg = "refine: base is 'refine' itself; name the solver whose path is to be refined"
            raise SolverSettingError(msg)
        self._base()

    def _base(self) -> Solver | tuple[Point, ...]:
        """Build the solver behind `base`, the seed handed on; waypoints stay as they are."""
        base = cast("Any", registry.get(self.base) if isinstance(self.base, str) else self.base)
        if self.base_seed is None:
            return cast("Solver | tuple[Point, ...]", base)
        if not (hasattr(base, "traits") and base.traits.seeded):
            name = base.traits.name if hasattr(base, "traits") else "a path"
            what = f"base_seed is {shown(self.base_seed)}, but the base, {name}, draws no random numbers"
            msg = f"refine: {what}; leave it out"
            raise SolverSettingError(msg)
        return cast("Solver", dataclasses.replace(base, seed=self.base_seed))

    def solve(self, problem: Problem) -> Solution:
        """Run the base, then refine its path."""
        base = self._base()
        if isinstance(base, tuple):
            found = problem.judge(Solution(Status.FOUND, path=np.array(base), cost=problem.evaluate(base).cost))
            if found.status is Status.FAILED:
                return Solution(Status.UNSUPPORTED, message=f"the base does not fit: {found.message}")
        else:
            found = solving.solve(problem, base, resolution=self.resolution or 20)
        if not found.status.has_path:
            return found
        if not found.trace:
            moment = TracePoint(found.seconds, found.evaluations, found.cost)
            found = dataclasses.replace(found, trace=(moment,))
        return solving.refined(problem, found, tolerance=self.tolerance, max_points=self.max_points)
