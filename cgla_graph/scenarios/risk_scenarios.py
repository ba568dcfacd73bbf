"""Scenarios of uncertain risk from files: ``cgla plan --scenarios``."""

import math
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from pydantic import Field

from cgla_graph._text import counted
from cgla_graph._validate import file_path, instance, items
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.uncertain.field import UncertainField, sample_field
from cgla_graph.scenarios.area_tables import Table
from cgla_graph.scenarios.map_tables import RasterTable, ThreatTable, read_table
from cgla_graph.scenarios.text_files import read_text, scenario_errors

#: Where the format is explained.
COMMAND = "cgla plan --help"


class RiskScenarioTable(Table):
    """One way that the risk may be."""

    name: str = ""
    probability: float | None = Field(None, ge=0, le=1, description="of this scenario (default: all equal)")
    threats: list[ThreatTable] = Field(default_factory=list)
    rasters: list[RasterTable] = Field(default_factory=list)


class SampleTable(Table):
    """Scenarios drawn from the map's own threats, whose places, spreads or peaks are uncertain."""

    count: int = Field(50, ge=1, le=10_000)
    seed: int = Field(0, ge=0)
    place: float = Field(0.0, ge=0, description="standard deviation of places along each axis, map units")
    spread: float = Field(0.0, ge=0, le=10, description="standard deviation of the logarithm of spreads")
    peak: float = Field(0.0, ge=0, le=10, description="standard deviation of the logarithm of peaks")


class RiskScenariosTable(Table):
    """A file of scenarios, in the coordinates of its map: degrees on a map in longitude and latitude."""

    coordinates: Literal["plane", "lonlat"] = Field("plane", description="lonlat: centres of threats are degrees")
    adds: bool = Field(default=False, description="whether scenarios are added to the map's own risk, or replace it")
    scenarios: list[RiskScenarioTable] = Field(default_factory=list)
    sample: SampleTable | None = None


def read_scenarios(
    files: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], problem: Problem
) -> UncertainField:
    """
    Read the scenarios of the risk of a map from TOML files.

    A file has a table ``[[scenarios]]`` for each, with ``threats`` and ``rasters`` as in a map's own file, a
    ``probability`` and a ``name``; or one table ``[sample]``, whose keys are those of `sample_field`, to draw
    scenarios from the threats of the map. ``adds = true`` adds the scenarios to the map's own risk. On a map in
    degrees, ``coordinates = "lonlat"``.

    Parameters
    ----------
    files
        One file, or several, whose scenarios are put together.
    problem
        The problem on the map.

    Returns
    -------
    field
        To plan with: ``dataclasses.replace(problem, field=field)``.

    Raises
    ------
    ScenarioError
        If a file cannot be read or is malformed, or the probabilities do not add up to 1.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "two.toml")
    ...     _ = file.write_text('''
    ... [[scenarios]]
    ... probability = 0.75
    ... threats = [{ x = 0.5, y = 0.4, spread = 0.1 }]
    ... [[scenarios]]
    ... probability = 0.25
    ... ''')
    ...     field = read_scenarios(file, Problem((0.1, 0.1), (0.9, 0.9)))
    >>> len(field.scenarios), field.probabilities
    (2, (0.75, 0.25))
    """
    instance("problem", problem, Problem, problem_wanted)
    named = (
        (files,) if isinstance(files, str | os.PathLike) else items("files", files, "a list of files", ScenarioError)
    )
    fields: list[RiskField] = []
    chances: list[float | None] = []
    drawn: list[UncertainField] = []
    for one in named:
        file = file_path("a file of scenarios", one, ScenarioError)
        table = read_table(
            read_text(file, str(file), "a TOML file"), RiskScenariosTable, place=str(file), command=COMMAND
        )
        with scenario_errors(file):
            _check(table, problem)
            if table.sample is not None:
                drawn.append(sample_field(problem, **dict(table.sample)))
            for number, entry in enumerate(table.scenarios):
                with scenario_errors(f"scenarios.{number}"):
                    fields.append(_field(entry, table, file.parent, problem))
                    chances.append(entry.probability)
    with scenario_errors(", ".join(map(str, named)) or "files"):
        if drawn:
            if fields or len(drawn) > 1:
                msg = "a [sample] stands alone; give one, or scenarios"
                raise CglaError(msg)
            return drawn[0]
        given = [chance for chance in chances if chance is not None]
        if given and len(given) < len(chances):
            msg = f"{len(given)} of {counted(len(chances), 'scenario')} have a probability; give one to all, or to none"
            raise CglaError(msg)
        return UncertainField(fields, given or None)


def _check(table: RiskScenariosTable, problem: Problem) -> None:
    """Check that a file says one thing, in the coordinates of its map."""
    if (table.sample is None) == (not table.scenarios):
        held = "neither [[scenarios]] nor" if table.sample is None else "both [[scenarios]] and"
        msg = f"it has {held} [sample]; give one of the two"
        raise CglaError(msg)
    if table.sample is not None and table.adds:
        msg = "a [sample] draws the threats of the map anew, so that adds = true would count them twice; leave it out"
        raise CglaError(msg)
    if table.coordinates == "lonlat" and problem.projection is None:
        msg = "its coordinates are lonlat, and the map is in the plane; leave them out, or give a map in degrees"
        raise CglaError(msg)
    has_places = any(one.threats for one in table.scenarios)
    if "coordinates" not in table.model_fields_set and problem.projection is not None and has_places:
        msg = (
            'the map has a place on the Earth; say whether threats are in degrees (coordinates = "lonlat") or in '
            'map units (coordinates = "plane")'
        )
        raise CglaError(msg)


def _field(entry: RiskScenarioTable, table: RiskScenariosTable, folder: Path, problem: Problem) -> RiskField:
    """Build the risk of one scenario in map units."""
    own = problem.field if table.adds else RiskField()
    threats: list[Threat] = []
    for one in entry.threats:
        x, y = one.x, one.y
        if table.coordinates == "lonlat" and problem.projection is not None:
            x, y = problem.projection.forward((x, y)).tolist()
        if not (math.isfinite(x) and math.isfinite(y)):
            msg = f"a threat is at ({one.x}, {one.y}), which is no place on the map"
            raise CglaError(msg)
        try:
            threats.append(one.build(x, y))
        except ValueError as error:
            raise CglaError(str(error)) from error
    rasters = [_raster(one, table, folder, problem) for one in entry.rasters]
    return RiskField([*own.threats, *threats], rasters=[*own.rasters, *rasters])


def _raster(entry: RasterTable, table: RiskScenariosTable, folder: Path, problem: Problem) -> RasterRisk:
    """Read one raster."""
    if entry.covers is not None or entry.peaks is not None:
        msg = "covers and peaks are for the rasters of a map's own file; leave them out"
        raise CglaError(msg)
    corners = entry.bounds
    in_degrees = table.coordinates == "lonlat"
    raster = RasterRisk.from_file(
        folder / entry.file,
        bounds=None if corners is None else (corners[0], corners[1], corners[2], corners[3]),
        kind=entry.kind,
        interpolation=entry.interpolation,
        origin=entry.origin,
        scale=entry.scale,
        nodata=entry.nodata,
        unit=entry.unit,
        coordinates="lonlat" if in_degrees else "plane",
        projection=problem.projection if in_degrees else None,
    )
    return raster if entry.ground_risk is None else raster.flown_over_by(entry.ground_risk.build())
