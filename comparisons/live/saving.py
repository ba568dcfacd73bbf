"""Save a draft as TOML without overwriting other files."""

import re
from pathlib import Path
from typing import NamedTuple

from cgla_graph._files import write_files
from cgla_graph._text import shown
from cgla_graph.comparisons.live.draft import Draft, LiveMap, area_name, unwarned
from cgla_graph.comparisons.live.versions import GONE, NO_FILE, saving_in, version_of, version_with
from cgla_graph.errors import OutputError, ScenarioError
from cgla_graph.scenarios.lonlat_box import bounds_of
from cgla_graph.scenarios.map_tables import MapBuilder
from cgla_graph.scenarios.scenario import ScenarioTable, scenario_from_toml
from cgla_graph.scenarios.toml_text import toml_text
from cgla_graph.scenarios.writing import write_scenario

#: Names of files that may be written: no folders, nothing hidden.
NAME = re.compile(r"[\w][\w .+-]{0,99}\.toml")


def default_file(live: LiveMap) -> Path:
    """
    Return the default file of a map: the opened file, or one in the current folder.

    Examples
    --------
    >>> default_file(LiveMap.open("paper")).name
    'paper-live.toml'
    """
    if live.file is not None:
        return live.file.absolute()
    stem = re.sub(r"[^\w.+-]+", "-", live.scenario.name).strip("-.") or "map"
    return Path.cwd() / f"{stem[:80]}-live.toml"


class TakenError(OutputError):
    """A file that Save may replace only if the user says so."""


class Saved(NamedTuple):
    """A file that was written, and its version."""

    path: Path
    version: str


def save(live: LiveMap, draft: Draft, name: str, *, overwrite: bool, read: str | None = None) -> Path:
    """Write a draft as `write_draft` does, and return the path of the file."""
    return write_draft(live, draft, name, overwrite=overwrite, read=read).path


def write_draft(live: LiveMap, draft: Draft, name: str, *, overwrite: bool, read: str | None = None) -> Saved:
    """
    Write a draft as a scenario file, beside the file that was opened, or into the current folder.

    Parameters
    ----------
    live, draft
        The draft.
    name
        Of the file, without a folder; empty for `default_file`.
    overwrite
        Whether any file of that name may be replaced.
    read
        The version of the file that may be replaced, as `version_of` gives it; empty if there was none. None: the
        version of the opened file that was read here, or written since.

    Raises
    ------
    TakenError
        If the file on disk is another one than the one that was read: it changed, is gone, or was there already.
    OutputError
        If the name is invalid, or the file cannot be written.
    ScenarioError
        If the draft cannot be written as such a file, or would not load.
    """
    usual = default_file(live)
    if name and not NAME.fullmatch(name):
        msg = f"{shown(name)} is no name of a scenario file; give letters, digits, dots or dashes, and .toml at the end"
        raise OutputError(msg)
    path = usual.with_name(name) if name else usual
    if live.table is None and live.scenario.zones is not None:
        remedy = "write a scenario file with start, goal and no_fly.zones, open that, and Save writes it"
        msg = (
            f"{path}: a map of files of zones alone is not written, as their heights and times would be lost; {remedy}"
        )
        raise ScenarioError(msg)
    text = None if live.table is None else draft_toml(live, live.table, draft)
    if text is not None:
        # a file that does not load is not written
        with unwarned():
            scenario_from_toml(text, path.stem, folder=path.parent, where=path.name)
    with saving_in(path.parent):
        if not overwrite:
            _require_version(path, live.read.get(path, GONE) if read is None else read)
        # what a link leads to was read, and is written; with `overwrite`, a file replaces the link
        target = path.resolve() if path.is_symlink() and not overwrite else path
        if text is None:
            with unwarned():
                write_scenario(live.drawn(draft), target, overwrite=overwrite or target.exists())
            version = version_of(path)
        else:
            data = text.encode("utf-8", errors="backslashreplace")
            write_files({target: data})
            version = version_with(path, data)
        if path in live.read:
            live.read[path] = version
    return Saved(path, version)


def _require_version(path: Path, read: str) -> None:
    """Refuse to replace a file that is not the one that was read."""
    now = version_of(path)
    if now == read and now != NO_FILE:
        return
    if now == NO_FILE:
        msg = f"{path} is no file that can be read here (a folder, a pipe, or without permission); give another name"
        raise OutputError(msg)
    if read == GONE:
        msg = f"{path} is there already; give another name, or replace it"
    elif now == GONE:
        msg = f"{path} is gone: it was deleted or moved since it was read here; give another name, or write it again"
    else:
        msg = (
            f"{path} has changed since it was read here, and was not replaced; give another name, reload the page to "
            "see the new file, or replace it"
        )
    raise TakenError(msg)


def draft_toml(live: LiveMap, table: ScenarioTable, draft: Draft) -> str:
    """
    Return a draft as the text of its scenario file: parts that cannot be dragged keep their text.

    Examples
    --------
    >>> live = LiveMap.open("paper")
    >>> text = draft_toml(live, live.table, live.first)
    >>> scenario_from_toml(text, "again").problem.field == live.scenario.problem.field
    True
    """
    kept = table.model_dump(exclude_unset=True)
    kept.pop("random_threats", None)
    if live.places.projection is not None and table.bounds is None:
        # bounds derived from the draft would move with it
        folder = Path() if live.file is None else live.file.parent
        kept["bounds"] = list(bounds_of(MapBuilder(table, folder).box))
    start, goal = live.places.written([draft.start, draft.goal])
    centres = live.places.written([[one.x, one.y] for one in draft.threats])
    threats = [
        {"x": x, "y": y, "spread": one.spread, "peak": one.peak}
        for (x, y), one in zip(centres, draft.threats, strict=True)
    ]
    closed = (live.places.closed(area, area_name(number)) for number, area in enumerate(draft.areas, start=1))
    rings = [ring for one in closed for ring in one.rings]
    no_fly = {**kept.pop("no_fly", {}), "polygons": rings}
    if not rings:
        no_fly.pop("polygons")
    return toml_text({**kept, "start": start, "goal": goal, "k": draft.k, "threats": threats, "no_fly": no_fly or None})
