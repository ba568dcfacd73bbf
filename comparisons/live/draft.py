"""Drafts: the editable part of a map as the page sends it, its checks, and its conversion to a problem."""

import dataclasses
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, TypeVar

import shapely
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph.comparisons.live.areas import WrittenPlaces, as_flat
from cgla_graph.comparisons.live.versions import version_of
from cgla_graph.comparisons.report.maps import MOST_SAMPLES, RISK_SAMPLES, map_document
from cgla_graph.comparisons.study.options import MapOptions, open_one
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.clearance import closed_area
from cgla_graph.model.rasters.crs import CrsPlane
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.plots.degrees import compass
from cgla_graph.plots.risk_samples import risk_samples
from cgla_graph.scenarios.map_tables import MapBuilder
from cgla_graph.scenarios.scenario import Scenario, ScenarioTable, open_table
from cgla_graph.scenarios.table_faults import faults

#: Most threats and areas of a draft, and corners of an area.
MOST_THREATS, MOST_AREAS, MOST_CORNERS = 500, 200, 400
#: No number of a draft is greater: map units of any map, and risk weights.
GREATEST = 1e15


class Part(BaseModel):
    """A part of a message of the page: no unknown keys, no conversion of types, no infinite numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


Number = Annotated[float, Field(ge=-GREATEST, le=GREATEST)]
Place = Annotated[list[Number], Field(min_length=2, max_length=2)]
Area = Annotated[list[Place], Field(min_length=3, max_length=MOST_CORNERS)]


class DraftThreat(Part):
    """A threat on the page, map units."""

    x: Number
    y: Number
    spread: Annotated[float, Field(gt=0, le=GREATEST)]
    peak: Annotated[float, Field(gt=0, le=GREATEST)]


class Draft(Part):
    """
    The part of a map that the page can change, in map units.

    Examples
    --------
    >>> Draft(start=[0.0, 0.0], goal=[1.0, 1.0], k=3.0).threats
    []
    """

    start: Place
    goal: Place
    k: Annotated[float, Field(ge=0, le=GREATEST)]
    threats: Annotated[list[DraftThreat], Field(max_length=MOST_THREATS)] = Field(default_factory=list)
    areas: Annotated[list[Area], Field(max_length=MOST_AREAS)] = Field(default_factory=list)


PartT = TypeVar("PartT", bound=Part)


def read_part(kind: type[PartT], data: bytes) -> PartT:
    """
    Read a message of the page.

    Raises
    ------
    ScenarioError
        If it is malformed; the message names the fault in one line, as errors in scenario files do.

    Examples
    --------
    >>> read_part(Draft, b'{"start": [0, 0], "goal": [1, 1], "k": -1}')
    Traceback (most recent call last):
    cgla_graph.errors.ScenarioError: k: give at least 0 (it is -1)
    """
    try:
        return kind.model_validate_json(data)
    except ValidationError as error:
        raise ScenarioError(" ".join(faults(error, kind).split())) from error


@dataclass(frozen=True, eq=False)
class LiveMap:
    """
    A map being edited: its fixed part, and its first draft.

    Attributes
    ----------
    scenario
        As it was opened.
    first
        The draft with the same content.
    fixed
        No-fly areas that are not part of drafts: those of GeoJSON files and grid maps, and areas with holes.
    table
        The table of its file; None where it came from no scenario file.
    file
        That file; None for maps that are shipped, or no scenario file.
    places
        The numbers of that file for places on the page.
    read
        The version of that file which was read here, or written since.
    """

    scenario: Scenario
    first: Draft
    fixed: BaseGeometry | None = None
    table: ScenarioTable | None = None
    file: Path | None = None
    places: WrittenPlaces = field(default_factory=WrittenPlaces)
    read: dict[Path, str] = field(default_factory=dict, repr=False)

    @classmethod
    def open(cls, spec: str) -> "LiveMap":
        """
        Open a map.

        Parameters
        ----------
        spec
            A shipped scenario, or a file as `cgla plan` takes it.

        Raises
        ------
        CglaError
            If there is no such map, or the file is malformed.

        Examples
        --------
        >>> live = LiveMap.open("paper")
        >>> len(live.first.threats), live.first.k, live.fixed
        (10, 10.0, None)
        """
        is_file = spec.lower().endswith(".toml")
        # (a change after this is one that Save refuses to replace)
        read = {Path(spec).absolute(): version_of(Path(spec))} if is_file else {}
        scenario = open_one("live", spec, MapOptions(takes_k=False))
        try:
            table = open_table(spec) if is_file or not Path(spec).suffix else None
        except ScenarioError:
            # a random map, or another map with a name and no file
            table = None
        problem = scenario.problem
        areas: list[list[list[float]]] = []
        fixed, places = problem.no_fly, WrittenPlaces()
        if table is not None:
            builder = MapBuilder(table, Path(spec).parent)
            if builder.projection is not None:
                places = WrittenPlaces(builder.projection, builder.box)
            places.lay([table.start, table.goal, *([one.x, one.y] for one in [*table.threats, *builder.drawn()])])
            areas = [places.lay_ring(ring) for ring in table.no_fly.polygons]
            others = builder.projected_no_fly[len(table.no_fly.polygons) :]
            fixed = shapely.GeometryCollection(others) if others else None
        few = len(areas) <= MOST_AREAS and all(len(area) <= MOST_CORNERS for area in areas)
        if not few or len(problem.field.threats) > MOST_THREATS:
            msg = (
                f"{spec} has {len(problem.field.threats)} threats and {len(areas)} areas; the page takes at most "
                f"{MOST_THREATS} and {MOST_AREAS}, the latter with up to {MOST_CORNERS} corners"
            )
            raise ScenarioError(msg)
        first = Draft(
            start=list(problem.start),
            goal=list(problem.goal),
            k=problem.k,
            threats=[DraftThreat(x=t.x, y=t.y, spread=t.spread, peak=t.peak) for t in problem.field.threats],
            areas=areas,
        )
        return cls(scenario, first, fixed, table, Path(spec) if is_file else None, places, read)

    def drawn(self, draft: Draft) -> Scenario:
        """
        Return the scenario of a draft.

        Raises
        ------
        CglaError
            If no path can be planned on it, for example with a start inside a no-fly area.
        """
        before = self.scenario.problem
        places = [draft.start, draft.goal, *([one.x, one.y] for one in draft.threats)]
        (x, y), (goal_x, goal_y), *centres = self.places.moved(places).tolist()
        laid = zip(centres, draft.threats, strict=True)
        threats = [Threat(at[0], at[1], spread=one.spread, peak=one.peak) for at, one in laid]
        with unwarned():
            field = RiskField(threats, rasters=before.field.rasters, improper=not before.field.is_proper)
            no_fly = self._no_fly(draft.areas)
            try:
                problem = dataclasses.replace(
                    before, start=(x, y), goal=(goal_x, goal_y), field=field, k=draft.k, no_fly=no_fly
                )
            except ProblemError as error:
                raise ProblemError(self._named(str(error), draft)) from error
        return dataclasses.replace(self.scenario, problem=problem)

    def seen(self, draft: Draft) -> dict[str, Any]:
        """Return what the areas of a draft close, as the page draws it: outlines or None each; and notes on them."""
        outlines: list[list[list[float]] | None] = []
        notes = []
        for number, area in enumerate(draft.areas, start=1):
            try:
                closed = self.places.closed(area, area_name(number))
            except CglaError:
                outlines.append(None)
                continue
            outlines.append(None if closed.outline is None else [as_flat(ring) for ring in closed.outline])
            notes += [closed.note] if closed.note else []
        return {"areas": outlines, "notes": notes}

    def _named(self, message: str, draft: Draft) -> str:
        """Add the name and the file of the area that start or goal is inside of, if it has any."""
        if not any(f"{where} the no-fly area" in message for where in ("is inside", "is where")):
            return message
        place = shapely.Point(draft.start if message.startswith("start") else draft.goal)
        bounds = self.scenario.problem.bounds

        def holds(shape: BaseGeometry) -> bool:
            return bool(shapely.contains_properly(closed_area(shape, bounds), place))

        for number, area in enumerate(draft.areas, start=1):
            if holds(self.places.closed(area, area_name(number)).shape):
                return message.replace("no-fly area", area_name(number), 1)
        zones = self.scenario.zones
        files = {} if zones is None else {record.label: record.file for record in zones.records}
        inside = (name for name, shape in self.scenario.areas if holds(shape))
        name = next(inside, None)
        if name is None:
            return message
        of = f" of {Path(files[name]).name}" if name in files else ""
        return message.replace("no-fly area", f"no-fly area {shown(name)}{of}", 1)

    def _no_fly(self, areas: Iterable[Area]) -> BaseGeometry | None:
        """Unite fixed areas and areas of a draft."""
        every = [*polygons(areas, self.places), *([] if self.fixed is None else [self.fixed])]
        return shapely.GeometryCollection(every) if every else None

    @cached_property
    def document(self) -> dict[str, Any]:
        """The fixed part of the page's map: bounds, fixed areas, rasters."""
        before = self.scenario.problem
        with unwarned():
            bare = RiskField((), rasters=before.field.rasters)
            kept = dataclasses.replace(before, field=RiskField(), no_fly=self.fixed)
            samples = risk_samples(
                dataclasses.replace(kept, field=bare), MOST_SAMPLES if before.field.rasters else RISK_SAMPLES
            )
        rows, columns = samples.density.shape
        raster = [float(f"{value:.4g}") for value in samples.density.ravel()] if before.field.rasters else None
        # (the page knows the projection around an origin; on the plane of other coordinates, it shows these)
        origin = None if isinstance(before.projection, CrsPlane) else before.projection
        return {
            "degrees": origin is not None and (self.table is None or self.table.coordinates == "lonlat"),
            "origin": None if origin is None else [origin.longitude, origin.latitude],
            "compass": None if origin is None else compass(origin, before.bounds)._asdict(),
            "name": self.scenario.name,
            "title": self.scenario.title,
            "unit": "" if self.scenario.projection is None else "m",
            "clearance": before.clearance,
            "improper": not before.field.is_proper,
            "draft": self.first.model_dump(),
            "map": map_document(dataclasses.replace(self.scenario, problem=kept)),
            "samples": {"rows": rows, "columns": columns, "raster": raster, "power": samples.power},
        }


def polygons(areas: Iterable[Area], places: WrittenPlaces | None = None) -> list[BaseGeometry]:
    """
    Return what areas of a draft close, map units: each all that it encloses.

    Raises
    ------
    CglaError
        If an area encloses nothing, or no file can have it; the message names it.

    Examples
    --------
    >>> [shape.area for shape in polygons([[[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 0], [1, 0], [1, 1]]])]
    [0.5, 0.5]
    """
    laid = places or WrittenPlaces()
    return [laid.closed(area, area_name(number)).shape for number, area in enumerate(areas, start=1)]


def area_name(number: int) -> str:
    """
    Return what the page calls an area, counted from 1.

    Examples
    --------
    >>> area_name(2)
    'no-fly area 2'
    """
    return f"no-fly area {number}"


@contextmanager
def unwarned() -> Iterator[None]:
    """Suppress warnings: small threats and improper fields are visible on the page."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
