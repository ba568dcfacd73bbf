"""Comparisons: every solver over the same cost, as tables, pictures and files; and the command line."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgla_graph.comparisons.leaderboard.leaderboard import standings as standings
    from cgla_graph.comparisons.leaderboard.performance import performances as performances
    from cgla_graph.comparisons.study.entrant import Contender as Contender
    from cgla_graph.comparisons.study.execution import run_study as run_study
    from cgla_graph.comparisons.study.rows import rows_of as rows_of
    from cgla_graph.comparisons.study.rows import summaries as summaries
    from cgla_graph.comparisons.study.runner import Run as Run
    from cgla_graph.comparisons.study.runner import compare as compare
    from cgla_graph.comparisons.study.stored import load as load
    from cgla_graph.comparisons.study.study import Study as Study

_HOMES = {
    "Contender": "study.entrant",
    "Run": "study.runner",
    "Study": "study.study",
    "compare": "study.runner",
    "load": "study.stored",
    "performances": "leaderboard.performance",
    "rows_of": "study.rows",
    "run_study": "study.execution",
    "standings": "leaderboard.leaderboard",
    "summaries": "study.rows",
}
__all__ = [
    "Contender",
    "Run",
    "Study",
    "compare",
    "load",
    "performances",
    "rows_of",
    "run_study",
    "standings",
    "summaries",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - any of the names above
    """Import a name when it is first used: the command line has to answer at once."""
    if name in _HOMES:
        value = getattr(importlib.import_module(f"cgla_graph.comparisons.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    msg = f"module 'cgla_graph.comparisons' has no attribute {name!r}"
    raise AttributeError(msg)
