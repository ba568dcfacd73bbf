"""Entering a study into its database: what is asked for, which must agree with what is there already."""

import dataclasses
import hashlib
import json
import math
import sqlite3
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime

import shapely

from cgla_graph.comparisons.study.codec import dumps, encode
from cgla_graph.comparisons.study.documents import Document, entrant_document, scenario_document
from cgla_graph.comparisons.study.provenance import Provenance
from cgla_graph.comparisons.study.stored import Content
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.errors import StudyError
from cgla_graph.scenarios.scenario import Scenario


def enter(connection: sqlite3.Connection, study: Study, origin: Provenance, workers: str, command: str) -> None:
    """Write a study into a database that may hold some of it, and that a session began."""
    for what, names in (
        ("scenario", [scenario.name for scenario in study.scenarios]),
        ("entrant", [entrant.label for entrant in study.entrants]),
    ):
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            msg = f"the study has more than one {what} of the name {twice[0]!r}; give each its own"
            raise StudyError(msg)
    is_new = connection.execute("SELECT COUNT(*) FROM study").fetchone()[0] == 0
    merged = study if is_new else _merged(study, Content.read(connection).study(study.source))
    words = {
        "title": merged.title,
        "seeds": list(merged.seeds),
        "tolerance": merged.tolerance,
        "seconds": merged.limits.seconds,
        "megabytes": merged.limits.megabytes,
    }
    rows = [(key, dumps(encode(value))) for key, value in words.items()]
    connection.executemany("INSERT OR REPLACE INTO study VALUES (?, ?)", rows)
    _enter_session(connection, study, origin, workers, command)
    scenarios = _enter_scenarios(connection, merged, origin)
    entrants = _enter_entrants(connection, merged)
    # what is not done is planned anew: a solver may have been installed since
    connection.execute("DELETE FROM cells WHERE id NOT IN (SELECT cell FROM answers)")
    connection.executemany(
        "INSERT INTO cells (place, scenario, contender, seed) VALUES (?, ?, ?, ?) "
        "ON CONFLICT (scenario, contender, seed) DO UPDATE SET place = excluded.place",
        [
            (place, scenarios[cell.scenario], entrants[cell.solver], dumps(encode(cell.seed)))
            for place, cell in enumerate(merged.cells())
        ],
    )


def _merged(study: Study, before: Study) -> Study:
    """Return a study with what was asked for before, which it must agree with."""
    for word in ("tolerance", "limits"):
        old, new = getattr(before, word), getattr(study, word)
        if old != new:
            asked = f"the study in the folder has {_told(old)}, this one {_told(new)}"
            msg = f"{asked}; keep that, or choose another folder"
            raise StudyError(msg)
    known = {scenario.name: scenario_document(scenario) for scenario in before.scenarios}
    for scenario in study.scenarios:
        _check_equal("scenario", scenario.name, known.get(scenario.name), scenario_document(scenario))
    known = {entrant.label: entrant_document(entrant) for entrant in before.entrants}
    for entrant in study.entrants:
        _check_equal("entrant", entrant.label, known.get(entrant.label), entrant_document(entrant))
    # in today's order; of equal ones, the first ones stay
    scenarios = {one.name: one for one in (*study.scenarios, *before.scenarios)}
    entrants = {one.label: one for one in (*study.entrants, *before.entrants)}
    return dataclasses.replace(
        study,
        scenarios=list(scenarios.values()),
        entrants=list(entrants.values()),
        seeds=tuple(dict.fromkeys((*study.seeds, *before.seeds))),
        title=study.title or before.title,
    )


def _told(setting: Limits | float | None) -> str:
    """Write limits or a tolerance as people do."""
    if isinstance(setting, Limits):
        return f"limits of {setting.seconds:g} seconds and {setting.megabytes:g} megabytes"
    return "no lower bounds" if setting is None else f"a tolerance of {setting:g}"


def _check_equal(what: str, name: str, old: Document | None, new: Document) -> None:
    """Refuse something of a known name that is another one; title and notes are words only."""
    if old is None:
        return
    differing = [key for key in new if key not in {"title", "notes"} and dumps(old[key]) != dumps(new[key])]
    if "problem" in differing:
        differing += [
            f"problem.{key}" for key in new["problem"] if dumps(old["problem"][key]) != dumps(new["problem"][key])
        ]
        differing.remove("problem")
    if differing:
        msg = (
            f"{what} {name!r} is not the one in the study so far: {', '.join(differing)} differ; "
            f"give it another name, or choose another folder"
        )
        raise StudyError(msg)


def _enter_session(
    connection: sqlite3.Connection, study: Study, origin: Provenance, workers: str, command: str
) -> None:
    texts = (
        datetime.now(UTC).isoformat(timespec="seconds"),
        origin.version,
        str(origin.revision or ""),
        origin.host,
        origin.machine,
        dumps(origin.packages),
        workers,
        command,
        study.source,
    )
    columns = "started, version, git, host, machine, packages, workers, command, source"
    connection.execute(
        f"INSERT INTO sessions ({columns}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",  # noqa: S608 - names of ours
        tuple(visible(text) for text in texts),
    )


def _enter_scenarios(connection: sqlite3.Connection, study: Study, origin: Provenance) -> dict[str, int]:
    """Write scenarios and return their keys."""
    known = {
        json.loads(document)["name"]: key
        for key, document in connection.execute("SELECT id, document FROM scenarios").fetchall()
    }
    for place, scenario in enumerate(study.scenarios):
        if scenario.name in known:
            connection.execute("UPDATE scenarios SET place = ? WHERE id = ?", (place, known[scenario.name]))
            continue
        document = scenario_document(scenario)
        # many scenarios on one map share its area
        digest, wkb = None, document["problem"].pop("no_fly")
        if wkb is not None:
            digest = hashlib.sha256(bytes.fromhex(wkb)).hexdigest()
            connection.execute("INSERT OR IGNORE INTO areas VALUES (?, ?)", (digest, bytes.fromhex(wkb)))
        row = (place, dumps(document), digest)
        key = connection.execute("INSERT INTO scenarios (place, document, area) VALUES (?, ?, ?)", row).lastrowid or 0
        add_experiment(connection, key, scenario, study, origin)
        known[scenario.name] = key
    return known


def _enter_entrants(connection: sqlite3.Connection, study: Study) -> dict[str, int]:
    """Write entrants and return their keys."""
    known = {
        json.loads(document)["label"]: key
        for key, document in connection.execute("SELECT id, document FROM contenders").fetchall()
    }
    for place, entrant in enumerate(study.entrants):
        if entrant.label in known:
            connection.execute("UPDATE contenders SET place = ? WHERE id = ?", (place, known[entrant.label]))
            continue
        document = entrant_document(entrant)
        told = {key: value for key, value in document.items() if key != "label" and value}
        row = (visible(entrant.label), dumps(told))
        key = connection.execute("INSERT INTO plannerConfigs (name, settings) VALUES (?, ?)", row).lastrowid or 0
        connection.execute("INSERT INTO contenders VALUES (?, ?, ?)", (key, place, dumps(document)))
        known[entrant.label] = key
    return known


def add_experiment(
    connection: sqlite3.Connection, key: int, scenario: Scenario, study: Study, origin: Provenance
) -> int:
    """Write the experiment of a scenario with this version on this machine: Planner Arena compares versions."""
    row = {
        "name": visible(scenario.name),
        "totaltime": 0.0,
        "timelimit": study.limits.seconds if math.isfinite(study.limits.seconds) else None,
        "memorylimit": study.limits.megabytes if math.isfinite(study.limits.megabytes) else None,
        "runcount": 0,
        "version": origin.label,
        "hostname": visible(origin.host),
        "cpuinfo": visible(origin.machine),
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S"),
        "seed": _listed(study.seeds),
        "setup": visible(_setup(scenario)),
    }
    insert = f"INSERT INTO experiments ({', '.join(row)}) VALUES ({', '.join('?' * len(row))})"  # noqa: S608 - names of ours
    experiment = connection.execute(insert, tuple(row.values())).lastrowid or 0
    connection.execute("INSERT INTO editions VALUES (?, ?)", (experiment, key))
    return experiment


def _setup(scenario: Scenario) -> str:
    problem, (columns, rows) = scenario.problem, scenario.lattice.shape
    corners = 0 if problem.no_fly is None else int(shapely.get_num_coordinates(problem.no_fly))
    lines = [
        scenario.full_title,
        f"from {problem.start} to {problem.goal} within {problem.bounds}, k = {problem.k:g}",
        f"threats: {len(problem.field.threats)}, corners of the no-fly area: {corners}",
        f"lattice: {columns} x {rows} points, {scenario.lattice.kind}",
        scenario.notes,
    ]
    return "\n".join(line for line in lines if line)


def _listed(seeds: Sequence[int]) -> str:
    """Write seeds into the 24 characters that OMPL has for them."""
    text = ", ".join(map(str, seeds))
    return text if len(text) <= 24 else f"{text[:23]}…"  # noqa: PLR2004


def visible(text: str) -> str:
    r"""
    Write text that every reader takes: what is no UTF-8 (from odd file names), and NUL, becomes an escape.

    Examples
    --------
    >>> print(visible("caf\udce9"))
    caf\udce9
    """
    return text.replace("\0", r"\x00").encode("utf-8", errors="backslashreplace").decode("utf-8")
