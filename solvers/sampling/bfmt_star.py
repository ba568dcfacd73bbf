"""BFMT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import Any, ClassVar

from cgla_graph.model.solver import Traits
from cgla_graph.solvers.sampling.fmt_star import FmtStar


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
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> BfmtStar(samples=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = Traits(
        "bfmt-star",
        "OMPL's BFMT* over the same cost",
        domain="plane",
        seeded=True,
        needs=("ompl",),
        isolated=True,
        needs_positive=True,
    )

    def _planner(self, si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        from ompl import geometric as og  # noqa: PLC0415 - optional

        return self._sized(og.BFMT(si))
