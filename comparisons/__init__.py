"""Comparisons: every solver over the same cost, as tables, pictures and files; and the command line."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgla_graph.comparisons.conformance.run import conform as conform
    from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of as standings
    from cgla_graph.comparisons.leaderboard.performance import performances as performances
    from cgla_graph.comparisons.study.entrant import Entrant as Contender
    from cgla_graph.comparisons.study.entrant import Entrant as Entrant
    from cgla_graph.comparisons.study.execution import run_study as run_study
    from cgla_graph.comparisons.study.rows import rows_of as rows_of
    from cgla_graph.comparisons.study.rows import summaries as summaries
    from cgla_graph.comparisons.study.runner import Run as Run
    from cgla_graph.comparisons.study.runner import compare as compare
    from cgla_graph.comparisons.study.store import load as load
    from cgla_graph.comparisons.study.study import Study as Study

_HOMES = {
    "Entrant": ("study.entrant", "Entrant"),
    "Run": ("study.runner", "Run"),
    "Study": ("study.study", "Study"),
    "compare": ("study.runner", "compare"),
    "conform": ("conformance.run", "conform"),
    "load": ("study.store", "load"),
    "performances": ("leaderboard.performance", "performances"),
    "rows_of": ("study.rows", "rows_of"),
    "run_study": ("study.execution", "run_study"),
    "standings": ("leaderboard.leaderboard", "leaderboard_of"),
    "summaries": ("study.rows", "summaries"),
    # its name before
    "Contender": ("study.entrant", "Entrant"),
}
__all__ = [
    "Contender",
    "Entrant",
    "Run",
    "Study",
    "compare",
    "conform",
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
        module, attribute = _HOMES[name]
        value = getattr(importlib.import_module(f"cgla_graph.comparisons.{module}"), attribute)
        globals()[name] = value
        return value
    msg = f"module 'cgla_graph.comparisons' has no attribute {name!r}"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    """List the names, imported or not."""
    return sorted({*__all__, *globals()})
