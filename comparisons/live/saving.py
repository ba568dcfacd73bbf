"""A draft as a scenario file: TOML that loads again, never over a file that nobody meant."""

import json
import math
import re
from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from cgla_graph._shown import shown
from cgla_graph.comparisons.files import write_text
from cgla_graph.comparisons.live.draft import Draft, LiveMap, polygons, unwarned
from cgla_graph.errors import OutputError, ScenarioError
from cgla_graph.scenarios.map_tables import MapBuilder
from cgla_graph.scenarios.scenario import scenario_from_toml

#: Names of files that may be written: no folders, nothing hidden.
NAME = re.compile(r"[\w][\w .+-]{0,99}\.toml")
#: Digits behind the point of degrees: a centimetre.
_DEGREES = 7


def default_file(live: LiveMap) -> Path:
    """
    Return where a map is saved if nothing else is said: the file that was opened, or one in the current folder.

    Examples
    --------
    >>> default_file(LiveMap.open("paper")).name
    'paper-live.toml'
    """
    if live.file is not None:
        return live.file.absolute()
    stem = re.sub(r"[^\w.+-]+", "-", live.scenario.name).strip("-.") or "map"
    return Path.cwd() / f"{stem[:80]}-live.toml"


def save(live: LiveMap, draft: Draft, name: str, *, overwrite: bool) -> Path:
    """
    Write a draft as a scenario file, beside the file that was opened, or into the current folder.

    Parameters
    ----------
    live, draft
        What to write.
    name
        Of the file, without a folder; empty for `default_file`.
    overwrite
        Whether a file of that name may be replaced. The one that was opened always may.

    Raises
    ------
    OutputError
        If the name is none, the file is there already or cannot be written.
    ScenarioError
        If the draft cannot be written as such a file, or would not load.
    """
    usual = default_file(live)
    if name and not NAME.fullmatch(name):
        msg = f"{shown(name)} is no name of a scenario file; give letters, digits, dots or dashes, and .toml at the end"
        raise OutputError(msg)
    path = usual.with_name(name) if name else usual
    is_own = live.file is not None and path == usual
    if not overwrite and not is_own and path.exists():
        msg = f"{path} is there already; give another name, or replace it"
        raise OutputError(msg)
    text = draft_toml(live, draft)
    # what cannot be opened again is not written
    with unwarned():
        scenario_from_toml(text, path.stem, folder=path.parent, where=path.name)
    return write_text(path, text)


def draft_toml(live: LiveMap, draft: Draft) -> str:
    """
    Return a draft as the text of a scenario file.

    Raises
    ------
    ScenarioError
        If such a file cannot say it: rasters and areas of other kinds of files.

    Examples
    --------
    >>> live = LiveMap.open("paper")
    >>> scenario_from_toml(draft_toml(live, live.first), "again").problem.field == live.scenario.problem.field
    True
    """
    problem, projection = live.scenario.problem, live.scenario.projection
    if live.table is None and (problem.field.rasters or live.fixed is not None):
        msg = f"{live.scenario.name} is no scenario file, and its rasters and areas cannot be written into one"
        raise ScenarioError(msg)

    def places(points: Iterable[Iterable[float]]) -> list[list[float]]:
        array = np.array(list(points), dtype=np.float64).reshape(-1, 2)
        found: list[list[float]] = (array if projection is None else projection.inverse(array).round(_DEGREES)).tolist()
        return found

    kept: dict[str, Any] = {} if live.table is None else live.table.model_dump(exclude_unset=True)
    kept.pop("random_threats", None)
    start, goal = places([draft.start, draft.goal])
    centres = places([[one.x, one.y] for one in draft.threats])
    threats = [
        {"x": x, "y": y, "spread": one.spread, "peak": one.peak}
        for (x, y), one in zip(centres, draft.threats, strict=True)
    ]
    rings = [places(shapely.get_coordinates(shapely.get_exterior_ring(one))[:-1]) for one in polygons(draft.areas)]
    no_fly = {**kept.pop("no_fly", {}), "polygons": rings}
    if not rings:
        no_fly.pop("polygons")
    tables = {key: kept.pop(key) for key in ("lattice", "solvers", "rasters") if key in kept}
    top = {**kept, "start": start, "goal": goal, "k": draft.k, "threats": threats}
    if live.table is None and projection is None:
        top["bounds"] = list(problem.bounds)
    elif projection is not None:
        top["coordinates"] = "lonlat"
        if live.table is not None:
            # a box around what can be dragged would move with it
            folder = Path() if live.file is None else live.file.parent
            top["bounds"] = list(MapBuilder(live.table, folder).box)
    lines = [f"{key} = {_value(value)}" for key, value in top.items() if value is not None and key != "threats"]
    lines += ["threats = [", *(f"    {_inline(one)}," for one in threats), "]"]
    for key, table in ({"no_fly": no_fly} if no_fly else {}).items():
        lines += ["", f"[{key}]", *(f"{name} = {_value(value)}" for name, value in table.items() if value is not None)]
    for key, value in tables.items():
        lines += _table(key, value)
    return "\n".join(lines) + "\n"


def _table(key: str, value: Any) -> list[str]:  # noqa: ANN401 - whatever TOML has
    if isinstance(value, list):
        return [line for one in value for line in ("", f"[[{key}]]", *_lines(one))]
    nested = {name: part for name, part in value.items() if isinstance(part, Mapping)}
    lines = ["", f"[{key}]", *_lines({name: part for name, part in value.items() if name not in nested})]
    for name, part in nested.items():
        lines += ["", f"[{key}.{_key(name)}]", *_lines(part)]
    return lines


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(name)} = {_value(part)}" for name, part in table.items() if part is not None]


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _inline(table: Mapping[str, Any]) -> str:
    return "{ " + ", ".join(f"{_key(name)} = {_value(part)}" for name, part in table.items()) + " }"


def _value(value: Any) -> str:  # noqa: ANN401 - the same
    r"""
    Write a value as TOML.

    Examples
    --------
    >>> _value("a\x7f"), _value([1, 0.5, True])
    ('"a\\u007f"', '[1, 0.5, true]')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for this one letter
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        return _inline(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        msg = f"{value} is no number for a file"
        raise ScenarioError(msg)
    return repr(value)
