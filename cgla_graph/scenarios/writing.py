"""Writer of scenario files from problems built in Python; reading one restores the same problem."""

import dataclasses
import io
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import NoneType
from typing import Any, NoReturn

import numpy as np
import shapely
from pydantic import ValidationError
from shapely.geometry.base import BaseGeometry

from cgla_graph._files import write_files
from cgla_graph._text import place, shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path, instance, truth_value
from cgla_graph.errors import OutputError, ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.rasters.crs import CrsPlane
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.scenario import Scenario, ScenarioTable, as_scenario
from cgla_graph.scenarios.table_faults import faults
from cgla_graph.scenarios.toml_text import toml_text
from cgla_graph.untrusted.files import FilePath

#: Points a side of the lattice of a file that gives none.
USUAL = 20


def write_scenario(
    scenario: Scenario | Problem, path: FilePath, *, title: str | None = None, overwrite: bool = False
) -> Path:
    """
    Write a scenario or a problem as a scenario file; a failed write leaves no half-written file.

    Numbers are written in full: `load_scenario` gives the same problem back, to the last bit, under the name of the
    file. The cells of rasters go into files beside it, NAME-risk.npy. A map in longitude and latitude is written in
    metres around the origin of its projection, which the file gives.

    Parameters
    ----------
    scenario
        A scenario, or a problem.
    path
        Ends in ``.toml``.
    title
        A title of one line; None for the scenario's own.
    overwrite
        Whether files of these names may be replaced.

    Returns
    -------
    path
        The scenario file.

    Raises
    ------
    ScenarioError
        If the scenario holds anything that no scenario file can express; the message names it.
    OutputError
        If the ending is another one, or a file exists already or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), no_fly=shapely.box(0.4, 0.4, 0.6, 0.6))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = load_scenario(write_scenario(problem, f"{folder}/mine.toml"))
    >>> again.name, again.problem.goal, again.problem.area.geometry == problem.area.geometry
    ('mine', (0.9, 0.9), True)
    """
    target = file_path("path", path, OutputError)
    instance("title", title, (str, NoneType), "a text", ScenarioError)
    truth_value("overwrite", overwrite, OutputError)
    if target.suffix.lower() != ".toml":
        msg = f"{place(target)}: no scenario is written so; give a file that ends in .toml"
        raise OutputError(msg)
    if not isinstance(scenario, Scenario | Problem):
        msg = f"{place(target)}: what to write is {shown(scenario)}; give a Scenario or a Problem"
        raise ScenarioError(msg)
    given = as_scenario(scenario, target.stem)
    rasters = given.problem.field.rasters
    beside = [target.with_name(f"{target.stem}-risk{f'-{i}' if i > 1 else ''}.npy") for i in range(1, len(rasters) + 1)]
    text = _text(given, [file.name for file in beside], given.title if title is None else title, place(target))
    arrays: dict[Path, bytes] = {}
    for file, raster in zip(beside, rasters, strict=True):
        arrays[file] = _array(raster.values)
        if raster.peaks is not None:
            arrays[_of_peaks(file)] = _array(raster.peaks)
    # the scenario comes last: it names no file that is not there
    files = {**arrays, target: text}
    for file in files:
        if not overwrite and file.exists():
            msg = f"{place(file)}: is there already; choose another name, or say overwrite=True"
            raise OutputError(msg)
    write_files(files)
    return target


def _place_on_earth(projection: LocalProjection | None) -> dict[str, Any]:
    """Return the key that says where the plane is on the Earth."""
    if isinstance(projection, CrsPlane):
        return {"crs": projection.system.wkt}
    return {"projection_origin": None if projection is None else [projection.longitude, projection.latitude]}


def _text(scenario: Scenario, beside: Sequence[str], title: str, where: str) -> bytes:
    """Return the content of the file; `beside` names those of the rasters."""
    problem = scenario.problem
    _require_sayable(scenario, where)
    areas = list(_areas(scenario, where))
    is_plain = not any("name" in area or "holes" in area for area in areas)
    outlines = [area["outline"] for area in areas]
    origin = problem.projection
    document: dict[str, Any] = {
        "title": title or None,
        "notes": scenario.notes or None,
        **_place_on_earth(origin),
        "bounds": list(problem.bounds),
        "start": list(problem.start),
        "goal": list(problem.goal),
        "k": problem.k,
        "clearance": problem.clearance or None,
        "improper": problem.field.improper or None,
        "threats": [dataclasses.asdict(one) for one in problem.field.threats] or None,
        "no_fly": ({"polygons": outlines} if is_plain else {"areas": areas}) if areas else None,
        "rasters": [_raster(file, one) for file, one in zip(beside, problem.field.rasters, strict=True)] or None,
        "lattice": _lattice(scenario.lattice),
        "solvers": {name: dict(settings) for name, settings in scenario.settings.items()} or None,
    }
    document = {key: value for key, value in document.items() if value is not None}
    try:
        ScenarioTable.model_validate(document)
    except ValidationError as error:
        msg = f"{where}: {faults(error, ScenarioTable)}"
        raise ScenarioError(msg) from error
    try:
        return toml_text(document).encode("utf-8")
    except UnicodeEncodeError as error:
        wrong = error.object[error.start]
        msg = f"{where}: a title, note or name in it holds {wrong!r}, which is half a character; take it out"
        raise ScenarioError(msg) from error


def _require_sayable(scenario: Scenario, where: str) -> None:
    """Refuse a scenario that a file cannot express; a problem alone fails only for rasters outside its bounds."""
    problem = scenario.problem
    if scenario.y_down:
        _refuse(where, "its y grows downwards, as that of grid maps", "a scenario file has none such")
    if scenario.zones is not None:
        _refuse(where, "it has zones, of files with heights and times", "written out, they are areas without these")
    if scenario.in_time:
        _refuse(where, "its map changes in time", "only a map that stands still is written")
    if scenario.lattice.bounds != problem.bounds:
        _refuse(where, f"its lattice lies in {scenario.lattice.bounds}", "one of a file lies in the problem's bounds")
    x_min, y_min, x_max, y_max = problem.bounds
    for number, raster in enumerate(problem.field.rasters):
        west, south, east, north = raster.bounds
        if east <= x_min or x_max <= west or north <= y_min or y_max <= south:
            msg = f"{where}: raster {number} lies at {raster.bounds}, outside the bounds {problem.bounds}; leave it out"
            raise ScenarioError(msg)


def _refuse(where: str, wrong: str, allowed: str) -> NoReturn:
    msg = f"{where}: cannot be written: {wrong}, and {allowed}; write its problem alone (scenario.problem)"
    raise ScenarioError(msg)


def _areas(scenario: Scenario, where: str) -> Iterator[dict[str, Any]]:
    """Yield the no-fly polygons in their order; the parts of an area have its name."""
    # two areas may have the same shape
    names: defaultdict[bytes, list[str]] = defaultdict(list)
    for name, shape in scenario.areas:
        if not shape.is_empty:
            names[shape.wkb].append(name)

    def name_of(shape: BaseGeometry) -> str:
        return names[shape.wkb].pop(0) if names[shape.wkb] else ""

    no_fly = scenario.problem.no_fly
    for area in _shapes(no_fly) if no_fly is not None else ():
        name = name_of(area)
        for part in shapely.get_parts(area):
            if part.is_empty:
                continue
            own = name or name_of(part)
            rings = shapely.get_rings(shapely.force_2d(part))
            outline, *holes = (shapely.get_coordinates(ring)[:-1].tolist() for ring in rings)
            yield {**({"name": own} if own else {}), "outline": outline, **({"holes": holes} if holes else {})}
    if left := [name for unused in names.values() for name in unused]:
        _refuse(where, f"its area {shown(min(left))} is none of its problem's", "a scenario file has no others")


def _shapes(area: BaseGeometry) -> Iterator[BaseGeometry]:
    """Return the polygons and multipolygons of an area."""
    if isinstance(area, shapely.GeometryCollection):
        for part in area.geoms:
            yield from _shapes(part)
    else:
        yield area


def _raster(file: str, raster: RasterRisk) -> dict[str, Any]:
    usual = {"scale": 1.0, "nodata": None, "interpolation": "bilinear", "origin": "upper", "unit": None}
    given = {key: getattr(raster, key) for key, value in usual.items() if getattr(raster, key) != value}
    if raster.failures is not None:
        given["ground_risk"] = dataclasses.asdict(raster.failures)
    if raster.covers is not None:
        given["covers"] = raster.covers.wkt
    if raster.peaks is not None:
        given["peaks"] = _of_peaks(Path(file)).name
    return {"file": file, **given, "bounds": list(raster.bounds)}


def _of_peaks(file: Path) -> Path:
    """Return the file of the greatest values of cells, beside that of the cells."""
    return file.with_name(f"{file.stem}-peaks.npy")


def _array(values: FloatArray) -> bytes:
    """Return an array as the bytes of a .npy."""
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=False)
    return stream.getvalue()


def _lattice(lattice: Lattice) -> dict[str, Any] | None:
    columns, rows = lattice.shape
    found: dict[str, Any] = {}
    if (columns, rows) != (USUAL, USUAL):
        found["resolution"] = columns if columns == rows else [columns, rows]
    if lattice.kind != "closed":
        found["kind"] = lattice.kind
    return found or None
