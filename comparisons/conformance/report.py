"""The commands `conform` and `answer`: checks of a planner against proven optima, their tables and files."""

import math
import platform
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from cgla_graph import __version__
from cgla_graph._text import at_most, counted, duration, figure, json_number, listed, percent, rounded_down, shown
from cgla_graph._validate import positive_number
from cgla_graph.comparisons import console
from cgla_graph.comparisons.conformance.documents import VERSION, read_problem
from cgla_graph.comparisons.conformance.run import checked, results_of
from cgla_graph.comparisons.conformance.suite import Instance, chosen
from cgla_graph.comparisons.conformance.verdict import Result, Verdict
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.solution import Status
from cgla_graph.solvers.solving import solve

#: Fields of a result in the JSON document.
KEYS = (
    "name", "family", "verdict", "message", "seconds", "cost", "length", "risk", "waypoints", "lower_bound",
    "upper_bound", "gap", "excess",
)  # fmt: skip
#: Statuses without a path that are answers; other statuses without a path are failures.
_NONE_FOUND = {Status.NO_PATH, Status.NOT_FOUND, Status.STUCK}


def run_suite(
    command: Sequence[str], asked: Sequence[Instance], *, seconds: float, megabytes: float, workers: int
) -> list[Result]:
    """
    Run a planner on instances, and return results in the order of the suite; after Ctrl-C, those so far.

    Raises
    ------
    CglaError
        If a setting is wrong, or the command cannot be started.
    """
    limits = Limits(positive_number("--timeout", seconds), positive_number("--memory", megabytes))
    results = []
    with console.progress(len(asked)) as step, suppress(KeyboardInterrupt):
        for result in results_of(checked(command), asked, limits, workers=workers):
            results.append(result)
            step(result.instance.name)
    places = {one.name: place for place, one in enumerate(asked)}
    return sorted(results, key=lambda one: places[one.instance.name])


def picked(names: str | None) -> list[Instance]:
    """Choose instances by names and families, separated by commas; all by default."""
    given = [] if names is None else [name.strip() for name in names.split(",")]
    if "" in given:
        msg = f"--instances {shown(names)} has an empty name; give names or families with commas between them"
        raise CglaError(msg)
    return chosen(given)


def passes(results: Sequence[Result], tolerance: float) -> bool:
    """Return whether every answer is right and no path exceeds the best known one by more than the tolerance."""
    return all(one.verdict.is_right and not one.excess > tolerance for one in results)


def print_results(results: Sequence[Result], tolerance: float) -> None:
    """Print a line an instance, the faults, and a summary."""
    notes = ("gap: at most this much more than the best possible", "over best: this much more than the best path known")
    table = FittedTable("", ("instance", "verdict"), ("cost", "gap", "over best", "time"), ("time", "over best"), notes)
    table.rows.extend(
        [
            one.instance.name,
            one.verdict.label,
            figure(one.cost, 7),
            at_most(one.gap),
            percent(one.excess),
            duration(one.seconds) if math.isfinite(one.seconds) else "-",
        ]
        for one in results
    )
    console.out_table(table)
    # several may have the same message
    said: dict[str, list[str]] = {}
    for one in results:
        said.setdefault(one.message, []).append(one.instance.name)
    for message, names in said.items():
        if message:
            console.out(f"{listed(names, 3)}: {message}\n")
    console.out(f"{summary(results, tolerance)}\n")
    for one in results:
        if one.verdict is Verdict.CONTRADICTION:
            console.say(
                f"cgla: {one.instance.name}: IMPOSSIBLE: {one.message}. This is a fault of the suite or of its oracle, "
                "not of the planner: please report it, with the planner's answer"
            )


def summary(results: Sequence[Result], tolerance: float) -> str:
    """Return a summary in one line."""
    right = sum(one.verdict.is_right for one in results)
    wrong = Counter(one.verdict.label for one in results if not one.verdict.is_right)
    parts = [f"{right} of {counted(len(results), 'answer')} right"]
    if wrong:
        parts.append(listed([f"{number} {label}" for label, number in wrong.items()]))
    gaps = sorted(one.gap for one in results if one.verdict is Verdict.FEASIBLE)
    if gaps:
        middle = 0.5 * (gaps[(len(gaps) - 1) // 2] + gaps[len(gaps) // 2])
        parts.append(f"median gap {at_most(middle)}, greatest {at_most(gaps[-1])}")
    if not passes(results, tolerance) and all(one.verdict.is_right for one in results):
        over = [one.instance.name for one in results if one.excess > tolerance]
        parts.append(f"more than {100.0 * tolerance:g} % over the best path known: {listed(over)}")
    return "; ".join(parts)


def document(
    command: Sequence[str], asked: Sequence[Instance], results: Sequence[Result], *, seconds: float, tolerance: float
) -> dict[str, Any]:
    """Return all results as JSON."""
    return {
        "version": VERSION,
        "command": list(command),
        "timeout": seconds,
        "tolerance": json_number(tolerance),
        "passed": len(results) == len(asked) and passes(results, tolerance),
        "right": sum(one.verdict.is_right for one in results),
        "asked": len(asked),
        "cgla_graph": __version__,
        "machine": platform.platform(),
        "results": [_row(one) for one in results],
    }


def _row(one: Result) -> dict[str, Any]:
    numbers = {key: json_number(getattr(one, key)) for key in ("seconds", "cost", "length", "risk", "gap", "excess")}
    row = {
        "name": one.instance.name,
        "family": one.instance.family,
        "verdict": one.verdict.label,
        "message": one.message,
        "waypoints": one.waypoints,
        "lower_bound": one.instance.lower_bound,
        "upper_bound": one.instance.upper_bound,
        **numbers,
    }
    return {key: row[key] for key in KEYS}


def listing() -> list[dict[str, Any]]:
    """List the instances."""
    return [
        {
            "name": one.name,
            "family": one.family,
            "title": one.title,
            "lower_bound": one.lower_bound,
            "upper_bound": one.upper_bound,
        }
        for one in chosen()
    ]


def print_listing() -> None:
    """Print a line an instance."""
    table = FittedTable("", ("instance", "title"), ("lower bound", "upper bound"), ("upper bound",))
    for one in chosen():
        lower, upper = (math.inf if bound is None else bound for bound in (one.lower_bound, one.upper_bound))
        table.rows.append([one.name, one.title, rounded_down(lower, 6), figure(upper, 6)])
    console.out_table(table)


def problem_text(name: str) -> str:
    """Return the problem of one instance, as planners get it."""
    found = [one for one in chosen([name]) if one.name == name]
    if not found:
        msg = f"{shown(name)} is a family; give the name of one instance (cgla conform --list shows them)"
        raise CglaError(msg)
    return f"{found[0].problem.model_dump_json()}\n"


def answer(text: str, solver: str, resolution: int, *, refine: bool = False) -> dict[str, Any]:
    """
    Answer a problem with one of the solvers here, as any other planner does.

    Raises
    ------
    CglaError
        If the problem or the solver is invalid, or the solver fails.

    Examples
    --------
    >>> answer(problem_text("infeasible-wall"), "dijkstra", 10)
    {'path': None}
    """
    problem = read_problem(text).build()
    entrant = Entrant.parse(solver)
    with console.running_solvers():
        found = solve(problem, entrant.name, resolution=resolution, refine=refine, **entrant.settings)
    if found.status.has_path:
        # (here, a claim is what a planner says)
        said = found.claimed_bound if math.isnan(found.lower_bound) else found.lower_bound
        bound = {"lower_bound": said} if math.isfinite(said) else {}
        return {"path": found.path.tolist(), "cost": found.cost, **bound}
    if found.status in _NONE_FOUND:
        return {"path": None}
    msg = f"{solver}: {found.message or found.status.value}"
    raise CglaError(msg)


def read_stdin() -> str:
    """Read a problem from standard input."""
    return sys.stdin.buffer.read().decode("utf-8", "replace")
