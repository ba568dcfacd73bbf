"""The report of a study as one HTML page that needs no network and no other file."""

import json
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from cgla_graph._text import counted
from cgla_graph.comparisons.files import write_text
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow, leaderboard_of
from cgla_graph.comparisons.leaderboard.profiles import able, instance_costs, performance_profile, success_curve
from cgla_graph.comparisons.numbers import rounded_all
from cgla_graph.comparisons.report.missions import missions_part
from cgla_graph.comparisons.report.parts import failure_grid, failures, rank_picture, ranking_table
from cgla_graph.comparisons.report.payload import (
    MOST_POINTS_OVERALL,
    columns_document,
    rerun_command,
    rows_document,
    scenarios_document,
    statuses_document,
    thinned,
)
from cgla_graph.comparisons.statistics.ranking import ranking
from cgla_graph.comparisons.study.proofs import linked_proofs
from cgla_graph.comparisons.study.provenance import Session
from cgla_graph.comparisons.study.rows import by_scenario, by_solver
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.sampling import independence_note
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.comparisons.tables.overview import overview
from cgla_graph.plots.standing_out import standing_out

NOTES = (
    ("cost", "Length plus k times the risk of a path, re-evaluated by the oracle; no solver is trusted about its own."),
    ("median", "Over the seeds of a solver; of two middle runs it is the cheaper one's. Failures count as infinite."),
    (
        "gap",
        "How far a cost is above the scenario's proven lower bound, relative to it: no path can have a gap below 0.",
    ),
    (
        "interval",
        "It covers the true value with 95 % confidence, for any distribution; a median needs 6 values.",
    ),
    ("never, ∞", "Most runs never get there. They are not left out, as that would favour solvers that fail often."),
    ("time", "Seconds of the machine that the run took place on. Where building the graph counts, it says so."),
    (
        "p",
        "Probability of such a difference by chance (Wilcoxon), after Holm for all pairs; few scenarios keep it large.",
    ),
    ("rank", "On each scenario the cheapest has rank 1; equals share their mean rank. It depends on who takes part."),
)


def report_html(stored: Stored, *, live: bool = False) -> str:
    """
    Write the page.

    Parameters
    ----------
    stored
        The study, finished or not.
    live
        Whether a server answers beside it, which the page asks for news (see `cgla view`).

    Returns
    -------
    page
        HTML. Characters outside UTF-8 (from odd file names) are escapes in it.
    """
    runs = stored.runs
    found, ranks = leaderboard_of(runs), ranking(instance_costs(runs))
    page = (
        _environment()
        .get_template("report.html")
        .render(
            title=stored.title or stored.folder.name or "Comparison",
            live=live,
            facts=_facts(stored),
            complete=stored.is_complete,
            n_runs=len(runs) + len(stored.flights),
            n_cells=stored.n_cells + stored.n_flights,
            progress=_progress(stored),
            overview=overview(found, len(stored.scenarios), independence_note(stored.scenarios)),
            missions=missions_part(stored),
            ranking=ranking_table(found, ranks),
            ranks=rank_picture(ranks),
            failures=failures(runs),
            grid=failure_grid(found, runs),
            success_note="the whole curve lies in them with 95 % confidence (Kolmogorov)",
            rerun=rerun_command(stored.folder),
            notes=NOTES,
            sessions=[_session(session) for session in stored.sessions],
            data=_embedded(_json(_document(stored, found, live=live))),
            css=_inlined("report.css"),
            script=_inlined("drawing.js") + _inlined("report.js"),
            plotly=_plotly(),
        )
    )
    return page.encode("utf-8", errors="backslashreplace").decode("utf-8")


def write_report(stored: Stored, path: Path) -> Path:
    """
    Write the page to a file, complete or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    return write_text(path, report_html(stored))


def _document(stored: Stored, found: Sequence[LeaderboardRow], *, live: bool) -> dict[str, Any]:
    """Collect what the script draws."""
    runs, groups, solvers = stored.runs, by_scenario(stored.runs), list(stored.solvers)
    places = {label: number for number, label in enumerate(solvers)}
    ranked = [places[one.solver] for one in found]
    names = [group[0].scenario.name for group in groups]
    known = {run.solver: run.solution.solver for run in runs}
    with_path = {run.solver for run in runs if run.solution.status.has_path}
    order = [one.solver for one in found]
    first = standing_out({label: known[label] for label in order}, [label for label in order if label in with_path])
    return {
        "live": live,
        "runs": len(runs) + len(stored.flights),
        "complete": stored.is_complete,
        "solvers": solvers,
        "order": ranked,
        "first": [places[label] for label in first],
        "names": names,
        "statuses": statuses_document(),
        "rerun": rerun_command(stored.folder),
        **scenarios_document(groups, solvers, linked_proofs(stored.folder, stored.scenarios)),
        "columns": columns_document(runs),
        "rows": rows_document(runs, names, solvers),
        "success": _success(runs, places),
        "profile": _profile(runs, places),
    }


def _success(runs: Sequence[Run], places: dict[str, int]) -> list[dict[str, Any]]:
    """Return the success over time of each solver, over all its runs."""
    documents = []
    for label, group in by_solver(able(runs)).items():
        curve = success_curve([run.solution for run in group])
        rows = thinned(np.column_stack([curve.seconds, curve.rate, curve.low, curve.high]), MOST_POINTS_OVERALL)
        columns = zip(("seconds", "rate", "low", "high"), rows.T, strict=True)
        documents.append({"solver": places[label], **{name: rounded_all(column, 4) for name, column in columns}})
    return documents


def _profile(runs: Sequence[Run], places: dict[str, int]) -> list[dict[str, Any]]:
    documents = []
    for label, profile in performance_profile(instance_costs(runs)).items():
        rows = thinned(np.column_stack([profile.at, profile.share]), MOST_POINTS_OVERALL)
        documents.append(
            {"solver": places[label], "factor": rounded_all(rows[:, 0], 6), "share": rounded_all(rows[:, 1], 4)}
        )
    return documents


def _facts(stored: Stored) -> list[str]:
    """Say when, with which version and on which machine."""
    if not stored.sessions:
        return []
    last = stored.sessions[-1]
    began = datetime.fromisoformat(stored.sessions[0].started).astimezone(UTC)
    revision = f"git {last.revision}" if last.git else ""
    when = f"{began.day} {began:%B %Y, %H:%M} UTC"
    return [fact for fact in (when, f"CGLA Graph {last.version}", revision, last.host, last.machine) if fact]


def _progress(stored: Stored) -> str:
    done, what = [], []
    if stored.scenarios or not stored.missions:
        done.append(f"{len(stored.runs):,} of {counted(stored.n_cells, 'run')}")
        what.append(counted(len(stored.scenarios), "scenario"))
    if stored.missions:
        done.append(f"{len(stored.flights):,} of {counted(stored.n_flights, 'flight')}")
        what.append(counted(len(stored.missions), "mission"))
    so_far = "" if stored.is_complete else " so far"
    what.append(counted(len(stored.solvers), "solver"))
    return f"{', '.join(done)}{so_far}; {', '.join(what)}"


def _session(session: Session) -> list[tuple[str, str]]:
    packages = ", ".join(f"{name} {version}" for name, version in session.packages.items())
    lines = [
        ("started", session.started),
        ("version", session.version),
        ("git", session.git),
        ("host", session.host),
        ("machine", session.machine),
        ("workers", session.workers),
        ("command", session.command),
        ("packages", packages),
        ("study", session.source),
    ]
    return [(word, str(value)) for word, value in lines if value]


@cache
def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FunctionLoader(_template),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@cache
def _template(name: str) -> str:
    return resources.files("cgla_graph.comparisons.report").joinpath("templates", name).read_text(encoding="utf-8")


def _inlined(name: str) -> Markup:
    """Return our own style sheet or script, which holds no user input."""
    return Markup(_template(name))  # noqa: S704 - not made of user input


def _plotly() -> Markup:
    """Return the basic bundle of plotly.js so that it can stand inside a script element, which a ``</script`` ends."""
    return Markup(re.sub("<(?=/script|script|!--)", r"\\x3c", _template("plotly-basic.min.js"), flags=re.IGNORECASE))  # noqa: S704 - as it was published


def _json(document: dict[str, Any]) -> str:
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def _embedded(text: str) -> Markup:
    r"""
    Escape JSON so that it can stand inside a script element.

    Examples
    --------
    >>> _embedded('{"name":"</script>"}')
    Markup('{"name":"\\u003c/script\\u003e"}')
    """
    # characters outside UTF-8 become visible escapes, as in the rest of the page
    text = re.sub("[\ud800-\udfff]", lambda found: f"\\\\u{ord(found[0]):04x}", text)
    for letter in "<>&\u2028\u2029":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)  # noqa: S704 - no letter that HTML knows is left in it
