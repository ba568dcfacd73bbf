"""What a user names on the command line: shipped scenarios, TOML files, GeoJSON areas and grid maps."""

import dataclasses
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Point
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.geojson import read_areas
from cgla_graph.gridmap import GridMap
from cgla_graph.lattice import Lattice
from cgla_graph.movingai import GridRow, check_row, map_beside, read_map, read_scenario_rows
from cgla_graph.problem import Problem
from cgla_graph.projection import LocalProjection
from cgla_graph.scenario import Scenario, load_scenario, project_area

#: The complete graph of a grid map joins its cells up to this many; a larger map gets a lattice of 50 a side.
MOST_CELLS = 6000


def open_scenarios(spec: str, *, start: Point | None = None, goal: Point | None = None) -> Iterator[Scenario]:
    """
    Open everything that one argument names, one scenario after the other.

    Parameters
    ----------
    spec
        A shipped scenario's name, a ``.toml`` scenario, a ``.geojson`` of no-fly areas, a ``.map``, or a ``.scen``
        with rows counted from 0: ``FILE.scen:ROW``, ``FILE.scen:FIRST-LAST``, or all of them without rows.
    start, goal
        Instead of the scenario's own, in the coordinates of the file (degrees where it holds longitudes and
        latitudes).

    Yields
    ------
    scenario
        A GeoJSON file without start and goal is crossed from its south-west to its north-east corner, 5 % outside the
        areas; a map without a ``.scen`` between two far-apart cells of its largest free region.

    Raises
    ------
    ScenarioError
        If something is missing or malformed.

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
    if kind in {".geojson", ".json"}:
        yield _areas_scenario(path, start, goal)
    elif kind == ".map":
        yield _map_scenario(path, start, goal)
    elif kind == ".scen":
        yield from (_moved(scenario, start, goal) for scenario in _row_scenarios(path, rows))
    else:
        yield _moved(load_scenario(spec), start, goal)


def _split_rows(spec: str) -> tuple[str, tuple[int, int] | None]:
    """Part ``FILE:FIRST-LAST`` into file and rows."""
    match = re.fullmatch(r"(.+\.\w+):(\d+)(?:-(\d+))?", spec)
    if match is None:
        return spec, None
    first = int(match[2])
    last = int(match[3]) if match[3] else first
    if last < first:
        msg = f"{spec}: the last row {last} is before the first {first}; write FIRST-LAST"
        raise ScenarioError(msg)
    return match[1], (first, last)


def _moved(scenario: Scenario, start: Point | None, goal: Point | None) -> Scenario:
    """Give a scenario another start or goal, in the coordinates of its file."""
    ends: dict[str, Point] = {}
    for name, given in (("start", start), ("goal", goal)):
        if given is not None and scenario.projection is not None:
            x, y = scenario.projection.forward(given).tolist()
            ends[name] = (x, y)
        elif given is not None:
            ends[name] = given
    if not ends:
        return scenario
    try:
        return dataclasses.replace(scenario, problem=dataclasses.replace(scenario.problem, **ends))  # type: ignore[arg-type]
    except CglaError as error:
        msg = f"{scenario.name}: {error}"
        raise ScenarioError(msg) from error


def _areas_scenario(path: Path, start: Point | None, goal: Point | None) -> Scenario:
    """Make no-fly areas of the polygons of a GeoJSON file."""
    areas: list[BaseGeometry] = [area.polygon for area in read_areas(path)]
    west, south, east, north = shapely.total_bounds(areas).tolist()
    margin_x, margin_y = 0.05 * (east - west), 0.05 * (north - south)
    corners = (
        (max(west - margin_x, -180.0), max(south - margin_y, -90.0)),
        (min(east + margin_x, 180.0), min(north + margin_y, 90.0)),
    )
    begin, end = start or corners[0], goal or corners[1]
    box = shapely.box(
        min(corners[0][0], begin[0], end[0]),
        min(corners[0][1], begin[1], end[1]),
        max(corners[1][0], begin[0], end[0]),
        max(corners[1][1], begin[1], end[1]),
    )
    try:
        projection = LocalProjection.centred_on(box.bounds)
        bounds = project_area(box, projection).bounds
        ends = [tuple(projection.forward(point).tolist()) for point in (begin, end)]
        no_fly = shapely.GeometryCollection([project_area(area, projection) for area in areas])
        problem = Problem(start=ends[0], goal=ends[1], bounds=bounds, no_fly=no_fly)
    except CglaError as error:
        msg = f"{path}: {error}"
        raise ScenarioError(msg) from error
    return Scenario(
        name=path.stem,
        title=f"{len(areas)} no-fly areas of {path.name}",
        problem=problem,
        lattice=_even_lattice(bounds, 900),
        projection=projection,
    )


def _even_lattice(bounds: tuple[float, float, float, float], n_points: int) -> Lattice:
    """Lay about `n_points` at nearly the same spacing along both sides."""
    width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
    columns = max(2, round((n_points * width / height) ** 0.5))
    return Lattice((columns, max(2, round(n_points / columns))), bounds=bounds)


@lru_cache(maxsize=2)
def _grid(path: Path) -> tuple[GridMap, BaseGeometry]:
    """Read a map and unite its cells once for all rows of a scenario file."""
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
    """Put the grid's own moves beside a complete graph over as many of its cell centres as are affordable."""
    height, width = grid.blocked.shape
    native = Lattice((max(width, 2), max(height, 2)), bounds=grid.bounds, kind="centre")
    few = native.n_points <= MOST_CELLS
    lattice = native if few else Lattice(50, bounds=grid.bounds, kind="centre")
    try:
        problem = Problem(start=ends[0], goal=ends[1], bounds=grid.bounds, no_fly=no_fly)
    except CglaError as error:
        msg = f"{name}: {error}"
        raise ScenarioError(msg) from error
    return Scenario(
        name=name,
        title=title,
        problem=problem,
        lattice=lattice,
        settings={"eight-direction": {"resolution": native, "corner_rule": "both-free"}},
        y_down=True,
    )
