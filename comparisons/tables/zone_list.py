"""The zones of maps: how many are closed, open and left out, and the list of them."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgla_graph.airspace.terrain.area import TerrainArea
from cgla_graph.airspace.zones.account import ZoneAccount, ZoneRecord
from cgla_graph.comparisons import console, files
from cgla_graph.errors import CglaError
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.airspace.plan_check.plan_map import PlanMap
    from cgla_graph.scenarios.mission_file import MissionFile

#: Columns of the list.
COLUMNS = ("scenario", *ZoneRecord.__dataclass_fields__)


def print_terrain(found: Mapping[str, TerrainArea], *, as_json: bool = False) -> dict[str, Any]:
    """
    Print which cells of elevations are closed on each map, and return it as JSON: under ``terrain``, by its name.

    Examples
    --------
    >>> print_terrain({})
    {}
    """
    for area in [] if as_json else found.values():
        console.out(f"terrain    {area.summary()}\n")
        for note in area.notes():
            console.out(f"note       {note}\n")
    return {"terrain": {name: area.document() for name, area in found.items()}} if found else {}


def print_zones(
    scenarios: "Iterable[Scenario | MissionFile | PlanMap]",
    target: Path | None,
    *,
    altitude: float | None,
    two: bool = False,
    as_json: bool,
) -> dict[str, Any]:
    """
    Print the states of all zones of some maps, and write the list of zones and no-fly areas if it has a file.

    Parameters
    ----------
    scenarios
        The maps.
    target
        The file of the list: ``.csv`` or ``.json``.
    altitude
        The altitude that was given for zones alone.
    two
        Whether the altitude is above the ground for zones, and above home in an exported plan.
    as_json
        Whether nothing is printed.

    Returns
    -------
    document
        The same as JSON: under ``zones``, by the scenario's name; empty where there are no zones.

    Raises
    ------
    CglaError
        If there are no zones or areas to list, or the file cannot be written.
    """
    scenarios = tuple(scenarios)
    accounts = {one.name: one.zones for one in scenarios if one.zones is not None}
    has_zones = bool(accounts)
    rows = [] if target is None else [(one.name, record) for one in scenarios for record in _records(one)]
    if (altitude is not None and not has_zones) or (target is not None and not rows):
        option = f"--altitude {altitude:g}" if target is None or rows else f"--zones-list {target}"
        what = "no zones or no-fly areas" if option.startswith("--zones") else "no zones"
        msg = f"{option}: there are {what} on the map; leave it out, or name their files (--no-fly FILE)"
        raise CglaError(msg)
    if target is not None:
        _write(target, rows)
        # (areas that are no zones count where they are listed)
        plain = {one.name: tuple(_records(one)) for one in scenarios if one.zones is None}
        accounts |= {name: ZoneAccount(records) for name, records in plain.items() if records}
    for account in [] if as_json else accounts.values():
        console.out(f"zones      {account.summary()}\n")
        for note in account.notes():
            console.out(f"note       {note}\n")
    if has_zones and two and not as_json:
        console.out("note       --altitude is above ground for zones, above home in plans; --above says it for both\n")
    if target is not None and not as_json:
        console.out(f"written to {target.parent}: {target.name}\n")
    return {"zones": {name: account.document() for name, account in accounts.items()}} if accounts else {}


def _records(on: "Scenario | MissionFile | PlanMap") -> list[ZoneRecord]:
    """Return the records of the areas and zones of a map, and of the map on which a plan is checked."""
    source = getattr(on, "source", None)
    own = [] if source is None else _records(source)
    account = getattr(on, "zones", None)
    return [*own, *getattr(on, "area_records", ()), *(() if account is None else account.records)]


def _write(target: Path, rows: Sequence[tuple[str, ZoneRecord]]) -> None:
    """Write the list of zones."""
    listed = [{"scenario": name, **vars(record)} for name, record in rows]
    kind = target.suffix.lower()
    if kind == ".json":
        text = json.dumps({"zones": listed}, ensure_ascii=False, indent=1) + "\n"
    elif kind == ".csv":
        stream = io.StringIO()
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(listed)
        text = stream.getvalue()
    else:
        msg = f"--zones-list {target}: no list is written so; give a file that ends in .csv or .json"
        raise CglaError(msg)
    files.make_folder(target.parent)
    files.write_text(target, text)
