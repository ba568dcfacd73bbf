"""Scenarios named on the command line: shipped ones, TOML files, no-fly areas, rasters and grid maps."""

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import shapely
from pydantic import ValidationError
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import cut, shown
from cgla_graph._types import Bounds, Point
from cgla_graph._validate import four_numbers, point
from cgla_graph.airspace.zones.reading import is_geojson
from cgla_graph.errors import CglaError, FileFormatError, ScenarioError
from cgla_graph.model.ground_risk import people_layers
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.rasters.ends import MapEnds
from cgla_graph.model.rasters.place import said_if_laid
from cgla_graph.model.rasters.reading import read_place
from cgla_graph.people.below import people_on
from cgla_graph.people.units import flown_over
from cgla_graph.scenarios.area_tables import NoFlyTable, applied_zones, with_files
from cgla_graph.scenarios.geojson import read_areas
from cgla_graph.scenarios.grid_map import GridMap
from cgla_graph.scenarios.lonlat_box import bounds_of, box_around
from cgla_graph.scenarios.map_tables import RasterTable
from cgla_graph.scenarios.movingai import GridRow, check_row, map_beside, read_map, read_scenario_rows
from cgla_graph.scenarios.scenario import Scenario, ScenarioTable, load_scenario, scenario_of
from cgla_graph.scenarios.table_faults import faults
from cgla_graph.scenarios.text_files import require_file, scenario_errors
from cgla_graph.untrusted.files import kind_of

#: The complete graph of a grid map joins its cells up to this many; a larger map gets a lattice of 50 a side.
MOST_CELLS = 6000
#: Points of the lattice over files of areas and rasters, about.
EVEN_POINTS = 900
#: The remedy where a path has no ends, and most characters of why no zone is closed.
GIVE_ENDS, MOST_REASONS = "give --start and --goal", 400
#: Endings of files of no-fly areas and zones; others are recognised by their content.
AREAS = (".geojson", ".json", ".kml", ".kmz")
#: Endings of rasters that are scenarios by themselves; .npz and .csv are those of graphs.
RASTERS = (".tif", ".tiff", ".asc", ".npy")


def open_scenarios(
    spec: str,
    *,
    start: Point | None = None,
    goal: Point | None = None,
    bounds: Bounds | None = None,
    k: float | None = None,
    clearance: float | None = None,
    no_fly: Sequence[Path] = (),
    zones: Mapping[str, object] | None = None,
    raster: Mapping[str, object] | None = None,
    aircraft: Mapping[str, float] | None = None,
) -> Iterator[Scenario]:
    """
    Open all scenarios that one argument names, one after the other.

    Parameters
    ----------
    spec
        A shipped scenario's name, a ``.toml`` scenario, a ``.geojson`` of no-fly areas, a file of zones (ED-269,
        ED-318, KML, KMZ: its content says), a raster of risk (``.tif``,
        ``.tiff``, ``.asc`` or ``.npy``; start and goal are needed, and k is 1), a ``.map``, or a ``.scen`` with rows
        counted from 0: ``FILE.scen:ROW``, ``FILE.scen:FIRST-LAST``, or all of them without rows.
    start, goal
        Replacements for the scenario's own, in the coordinates of the file (degrees where it holds longitudes and
        latitudes).
    bounds
        Replacement for the file's own, in its coordinates: ``(x_min, y_min, x_max, y_max)``, or west, south, east,
        north. A grid map keeps its own.
    k, clearance
        Replacements for the file's own.
    no_fly
        Files of more no-fly areas, on maps in longitude and latitude: GeoJSON, or zones.
    zones
        Settings of zones: altitude, at, treat, ground, lines, vertical_clearance, as in ``[no_fly]`` of scenario files.
    raster
        Settings of a raster, as `raster_scenario` takes them; only for a raster file.
    aircraft
        The aircraft that fails above the people of the map, as `cgla_graph.flown_over` takes it.

    Yields
    ------
    scenario
        Without start and goal, the path across a GeoJSON file leads from its south-west to its north-east corner, 5 %
        outside the areas; given ends widen the map by 100 km at most. The path across a map without a ``.scen`` joins
        two far-apart cells of its largest free region.

    Raises
    ------
    ScenarioError
        If something is missing or malformed, or start or goal is not on the map.

    Examples
    --------
    >>> [scenario.name for scenario in open_scenarios("paper")]
    ['paper']
    """
    path_text, rows = _split_rows(spec)
    path = Path(path_text)
    kind = path.suffix.lower()
    if rows is not None and kind != ".scen":
        msg = f"{spec}: only a .scen file has rows to pick; name the file alone"
        raise ScenarioError(msg)
    if bounds is not None and kind in {".map", ".scen"}:
        msg = f"{path}: a grid map has the bounds of its cells; leave out others"
        raise ScenarioError(msg)
    if kind in {".map", ".scen"} and no_fly:
        msg = f"{path}: a grid map has no longitudes and latitudes; leave out the areas of {no_fly[0]}"
        raise ScenarioError(msg)
    if kind in {".map", ".scen"} and zones:
        msg = f"{path}: a grid map has no zones; leave out {next(iter(zones))}"
        raise ScenarioError(msg)
    if raster and kind not in RASTERS:
        msg = f"{spec} is no raster (those end in {', '.join(RASTERS)}): leave out {next(iter(raster))}"
        raise ScenarioError(msg)
    opened = partial(_opened, path, rows, spec, start, goal, bounds, clearance, no_fly, zones or {})
    try:
        for scenario in opened(raster or {}):
            changed = _changed(scenario, k=k, clearance=clearance if kind in {".map", ".scen"} else None)
            if aircraft:
                if kind in RASTERS and all(one.unit is None for one in scenario.problem.field.rasters):
                    raise ScenarioError(_unknown_people(path, raster or {}, opened))
                with scenario_errors(spec):
                    changed = dataclasses.replace(changed, problem=flown_over(changed.problem, **aircraft))
            yield changed
    except FileFormatError as error:
        raise ScenarioError(str(error)) from error


def _unknown_people(
    path: Path, given: Mapping[str, object], opened: Callable[[dict[str, object]], Iterator[Scenario]]
) -> str:
    """Return the error of a raster whose values may be people, with the people on the map in each unit."""
    readings: dict[str, dict[str, object]] = {
        "--kind count (people of each cell)": {"kind": "count", "unit": None},
        "--unit people/km2": {"kind": "density", "unit": "people/km2"},
        "--unit people/m2": {"kind": "density", "unit": "people/m2"},
    }
    found = []
    for option, settings in readings.items():
        (one,) = opened({**given, **settings})
        people = sum(people_on(layer, one.problem.bounds) for layer in people_layers(one.problem))
        found.append(f"{people:,.0f} with {option}")
    return (
        f"{path}: an aircraft fails above people, and it is not said whether the values are people; say so. The people "
        f"on the map would be {', '.join(found)}"
    )


def _opened(
    path: Path,
    rows: tuple[int, int] | None,
    spec: str,
    start: Point | None,
    goal: Point | None,
    bounds: Bounds | None,
    clearance: float | None,
    no_fly: Sequence[Path],
    zones: Mapping[str, object],
    raster: Mapping[str, object],
) -> Iterator[Scenario]:
    """Open a file by its ending, or else by its content."""
    kind = path.suffix.lower()
    margin = clearance or 0.0
    if kind in RASTERS:
        yield raster_scenario(
            path, start=start, goal=goal, bounds=bounds, clearance=margin, no_fly=no_fly, zones=zones, settings=raster
        )
    elif kind in AREAS or (kind != ".toml" and holds_areas(path)):
        yield areas_scenario([path, *no_fly], start=start, goal=goal, bounds=bounds, clearance=margin, zones=zones)
    elif kind == ".map":
        yield _map_scenario(path, start, goal)
    elif kind == ".scen":
        yield from (_changed(scenario, start=start, goal=goal) for scenario in _row_scenarios(path, rows))
    else:
        yield load_scenario(
            spec, start=start, goal=goal, bounds=bounds, clearance=clearance, no_fly=no_fly, zones=zones
        )


def holds_areas(path: Path) -> bool:
    """
    Return whether a file begins like one of areas: like JSON, XML or an archive.

    Examples
    --------
    >>> holds_areas(Path("no such file"))
    False
    """
    try:
        # (a pipe would wait for its writer)
        if path.suffix.lower() in {".map", ".scen"} or not path.is_file():
            return False
        with path.open("rb") as stream:
            return kind_of(stream.read(4096)) != "text"
    except (OSError, ValueError):
        return False


def raster_scenario(
    path: Path,
    *,
    start: Point | None,
    goal: Point | None,
    bounds: Bounds | None = None,
    k: float = 1.0,
    clearance: float = 0.0,
    no_fly: Sequence[Path] = (),
    zones: Mapping[str, object] | None = None,
    settings: Mapping[str, object] | None = None,
) -> Scenario:
    """
    Make a scenario of a raster of risk alone, and of files of no-fly areas beside it.

    Parameters
    ----------
    path
        The raster. A GeoTIFF, or a ``.prj`` beside the file, states its coordinates; others are on a plane, unless
        `settings` give other coordinates or there are no-fly areas, which are in degrees. A raster whose metres are
        not those on the ground within 1 % is laid on a plane of its own.
    start, goal
        In the coordinates of the file, or in longitude and latitude; both are needed.
    bounds
        No path leaves these; for ``.npy``, they are the edges of the raster as well.
    k
        Risk weight.
    clearance
        How far paths have to stay from no-fly areas, map units.
    no_fly
        Files of GeoJSON or zones.
    zones
        Settings of zones: altitude, at, treat, ground, lines, vertical_clearance.
    settings
        Other keys of ``[[rasters]]`` in scenario files: kind, unit, scale, nodata, interpolation, origin; and
        coordinates, plane or lonlat.

    Raises
    ------
    ScenarioError
        If something is missing or malformed.
    """
    require_file(path)
    if start is None or goal is None:
        msg = f"{path}: a raster has no ends; give --start and --goal (longitude, latitude where it has degrees)"
        raise ScenarioError(msg)
    try:
        around = None if bounds is None else four_numbers("bounds", bounds)
        own = around if path.suffix.lower() == ".npy" else None
        given = dict(settings or {})
        coordinates: Any = given.pop("coordinates", None) or ("lonlat" if no_fly else None)
        at = read_place(path, bounds=own, coordinates=coordinates)
        if coordinates is None:
            said_if_laid(at)
        ends = MapEnds(point("start", start), point("goal", goal), around)
        if at.system is not None:
            ends = ends.read(at.system, at.bounds, in_degrees=at.coordinates == "lonlat", name=path.name)
        table = ScenarioTable(
            title=f"risk of {path.name}",
            coordinates=at.coordinates,
            start=list(ends.start),
            goal=list(ends.goal),
            k=k,
            clearance=clearance,
            bounds=None if ends.bounds is None else list(ends.bounds),
            rasters=[RasterTable.model_validate({"file": path.name, "bounds": own and list(own), **given})],
            no_fly=with_files(NoFlyTable(), no_fly, zones or {}),
        )
    except ValidationError as error:
        kind = RasterTable if error.title == RasterTable.__name__ else ScenarioTable
        msg = f"{path}: {faults(error, kind)}"
        raise ScenarioError(msg) from error
    except CglaError as error:
        raise ScenarioError(str(error) if str(path) in str(error) else f"{path}: {error}") from error
    try:
        scenario = scenario_of(table, path.parent, path.stem, str(path))
    except ScenarioError as error:
        # the map has one raster, whose file is named once
        raise ScenarioError(str(error).replace(f"{path}: rasters.0: {path}: ", f"{path}: ")) from error
    return _on_even_lattice(scenario)


def _split_rows(spec: str) -> tuple[str, tuple[int, int] | None]:
    """Split ``FILE:FIRST-LAST`` into file and rows."""
    match = re.fullmatch(r"(.+\.(?:scen|toml|geojson|json|map)):(.*)", spec, flags=re.IGNORECASE)
    if match is None:
        return spec, None
    numbers = re.fullmatch(r"(\d{1,20})(?:-(\d{1,20}))?", match[2])
    if numbers is None:
        msg = f"{match[1]}: {shown(match[2])} names no row; write ROW or FIRST-LAST, counted from 0"
        raise ScenarioError(msg)
    first = int(numbers[1])
    last = int(numbers[2] or first)
    if last < first:
        msg = f"{spec}: the last row {last} is before the first {first}; write FIRST-LAST"
        raise ScenarioError(msg)
    return match[1], (first, last)


def areas_scenario(
    files: Sequence[Path],
    *,
    start: Point | None = None,
    goal: Point | None = None,
    bounds: Bounds | None = None,
    clearance: float = 0.0,
    zones: Mapping[str, object] | None = None,
) -> Scenario:
    """
    Make a scenario of the no-fly areas of GeoJSON files, or of files of zones, named after the first.

    Parameters
    ----------
    files
        At least one.
    start, goal
        Degrees; None for the corners of the box around all areas, south-west and north-east.
    bounds
        No path leaves these, degrees; None for the box around all areas and the ends; of zones, with both ends given,
        for a box around these that holds every path at most 2.2 times as long as the way between them.
    clearance
        How far paths have to stay from the areas, metres.
    zones
        Settings of zones: altitude, at, treat, ground, lines, vertical_clearance.

    Raises
    ------
    ScenarioError
        If something is malformed, or start or goal is not on the map.
    """
    path = files[0]
    if not all(is_geojson(file) for file in files):
        return _zones_scenario(files, start, goal, bounds, clearance, zones or {})
    areas = [area for file in files for area in read_areas(file)]
    west, south, east, north = bounds_of(box_around(shapely.get_coordinates([area.polygon for area in areas])))
    no_fly = NoFlyTable(geojson=[path.name, *(str(file.absolute()) for file in files[1:])])
    what = f"{len(areas)} no-fly area{'s' * (len(areas) != 1)}"
    no_fly = with_files(no_fly, (), zones or {})
    return _crossed(files, what, start or (west, south), goal or (east, north), bounds, clearance, no_fly)


def _zones_scenario(
    files: Sequence[Path],
    start: Point | None,
    goal: Point | None,
    bounds: Bounds | None,
    clearance: float,
    settings: Mapping[str, object],
) -> Scenario:
    """Make a scenario of files of zones."""
    path = files[0]
    no_fly = with_files(NoFlyTable(), files, settings)
    no_fly = no_fly.model_copy(update={"geojson": [], "zones": [*no_fly.geojson, *no_fly.zones]})
    # (the error of a file does not name the first file)
    applied = applied_zones(no_fly, Path())
    count = len(applied.verdicts)
    box = None if bounds is None else four_numbers("bounds", bounds)
    if start is None or goal is None:
        closed = [one.area for one in applied.closed]
        if not closed:
            account = applied.account()
            why = cut("; ".join([account.summary(), *account.notes()]), MOST_REASONS)
            no_map = f"none of its {count} zones is closed"
            msg = f"{path}: {no_map}; {GIVE_ENDS}: without a closed zone, it is unknown where the map is ({why})"
            raise ScenarioError(msg)
        # (no end is inside a zone, not even one that counts only where a flight takes off or lands)
        low = [layer.area for one in applied.verdicts for layer in one.low]
        box = box or bounds_of(box_around(shapely.get_coordinates([*closed, *low])))
        start, goal = start or (box[0], box[1]), goal or (box[2], box[3])
    return _crossed(files, f"{count} zone{'s' * (count != 1)}", start, goal, box, clearance, no_fly)


def _crossed(
    files: Sequence[Path],
    what: str,
    start: Point,
    goal: Point,
    bounds: Bounds | None,
    clearance: float,
    no_fly: NoFlyTable,
) -> Scenario:
    """Make a scenario of files of areas and the ends of a path, degrees."""
    path = files[0]
    with scenario_errors(path):
        table = ScenarioTable(
            title=f"{what} of {', '.join(file.name for file in files)}",
            coordinates="lonlat",
            start=list(point("start", start)),
            goal=list(point("goal", goal)),
            k=0.0,
            clearance=clearance,
            bounds=None if bounds is None else list(four_numbers("bounds", bounds)),
            no_fly=no_fly,
        )
    return _on_even_lattice(scenario_of(table, path.parent, path.stem, ", ".join(map(str, files))))


def _changed(scenario: Scenario, **changes: Any) -> Scenario:  # noqa: ANN401 - fields of a problem
    """Replace fields of a scenario's problem; None keeps one."""
    changes = {name: value for name, value in changes.items() if value is not None}
    if not changes:
        return scenario
    with scenario_errors(scenario.name):
        return dataclasses.replace(scenario, problem=dataclasses.replace(scenario.problem, **changes))


def _on_even_lattice(scenario: Scenario) -> Scenario:
    """Lay a lattice of about `EVEN_POINTS` at nearly the same spacing along both sides."""
    bounds = scenario.problem.bounds
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    columns = max(2, round((EVEN_POINTS * width / height) ** 0.5))
    lattice = Lattice((columns, max(2, round(EVEN_POINTS / columns))), bounds=bounds)
    return dataclasses.replace(scenario, lattice=lattice)


def _grid(path: Path) -> tuple[GridMap, BaseGeometry]:
    """Read a map and unite its cells, once for all rows of a scenario file, and again when the file changes."""
    try:
        stamp = path.stat().st_mtime_ns, path.stat().st_size
    except (OSError, ValueError):
        stamp = (0, 0)
    return _grid_as_of(path, stamp)


@lru_cache(maxsize=2)
def _grid_as_of(path: Path, stamp: tuple[int, int]) -> tuple[GridMap, BaseGeometry]:  # noqa: ARG001 - part of the key
    grid = read_map(path)
    return grid, grid.no_fly()


def _map_scenario(path: Path, start: Point | None, goal: Point | None) -> Scenario:
    """Make a scenario of a grid map; start and goal are points, not cells."""
    grid, no_fly = _grid(path)
    begin, end = (start, goal) if start and goal else grid.far_pair()
    return _grid_scenario(path.stem, f"grid map {path.name}", grid, no_fly, (start or begin, goal or end))


def _row_scenarios(path: Path, rows: tuple[int, int] | None) -> Iterator[Scenario]:
    """Make a scenario of each chosen row."""
    every = read_scenario_rows(path)
    first, last = rows or (0, len(every) - 1)
    if last >= len(every):
        msg = f"{path}: there is no row {last}; it has rows 0 to {len(every) - 1}"
        raise ScenarioError(msg)
    for row in every[first : last + 1]:
        yield _row_scenario(path, row)


def _row_scenario(path: Path, row: GridRow) -> Scenario:
    grid, no_fly = _grid(map_beside(path, row))
    check_row(row, grid)
    ends = grid.centre(*row.start), grid.centre(*row.goal)
    title = f"row {row.index} of {path.name}: octile optimum {row.optimal_length:g}"
    return _grid_scenario(
        f"{path.name.removesuffix('.scen').removesuffix('.map')}:{row.index}", title, grid, no_fly, ends
    )


def _grid_scenario(name: str, title: str, grid: GridMap, no_fly: BaseGeometry, ends: tuple[Point, Point]) -> Scenario:
    """Make a scenario with the grid's own moves, and a lattice over all cell centres or, on large maps, 50 a side."""
    height, width = grid.blocked.shape
    # a lattice has two points a side at least; on a map of one row, the second lies outside, where no path leads
    side_x, side_y = max(width, 2), max(height, 2)
    native = Lattice((side_x, side_y), bounds=(0.0, 0.0, float(side_x), float(side_y)), kind="centre")
    own_cells = {"resolution": native, "corner_rule": "both-free"}
    few = native.n_points <= MOST_CELLS
    lattice = native if few else Lattice(50, bounds=grid.bounds, kind="centre")
    with scenario_errors(name):
        problem = Problem(start=ends[0], goal=ends[1], bounds=grid.bounds, no_fly=no_fly)
    return Scenario(
        name=name,
        title=title,
        problem=problem,
        lattice=lattice,
        settings={"eight-direction": own_cells, "lazy-theta-star": own_cells},
        y_down=True,
    )
