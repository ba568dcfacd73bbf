"""Scenarios: problems in TOML files, some of them shipped with the toolkit."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path
from reprlib import repr as short
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from shapely.geometry.base import BaseGeometry

from cgla_graph._files import read_text
from cgla_graph._types import Bounds, Point
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.geojson import read_areas
from cgla_graph.lattice import Lattice, LatticeKind
from cgla_graph.problem import Problem
from cgla_graph.projection import LocalProjection, project_area, projected_bounds
from cgla_graph.risk import Reading, RiskField, Threat


@dataclass(frozen=True, eq=False)
class Scenario:
    """
    A problem with a name, and with what a comparison needs to know beside it.

    Attributes
    ----------
    name, title
        A short name for tables and files, and one line that says what it shows.
    problem
        The problem, in map units (metres where `projection` is set).
    lattice
        The lattice that graph solvers plan on.
    settings
        Settings of solvers, by the solver's name, that suit this scenario.
    projection
        How longitude and latitude became metres; None for a map in the plane.
    y_down
        Whether y grows downwards, as in grid maps; pictures follow.
    notes
        Where the values come from.

    Examples
    --------
    >>> load_scenario("paper").problem.k
    10.0
    """

    name: str
    title: str
    problem: Problem
    lattice: Lattice
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    projection: LocalProjection | None = None
    y_down: bool = False
    notes: str = ""

    @property
    def full_title(self) -> str:
        """Name and title in one line."""
        return f"{self.name}: {self.title}" if self.title else self.name


#: Centres in a row that fall too near to start or goal before there is no room.
MOST_MISSES = 10_000

#: What pydantic calls the members of the unions below.
UNION_MEMBERS = ("int", "float", "str", "bool", "list[")


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def _rising(pair: list[float]) -> list[float]:
    """Check an interval of positive numbers."""
    if not 0.0 < pair[0] <= pair[1]:
        msg = "give the least and the greatest, both above 0"
        raise ValueError(msg)
    return pair


Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Range = Annotated[Pair, AfterValidator(_rising)]
Ring = Annotated[list[Pair], Field(min_length=3)]


class ThreatTable(_Table):
    """One threat: its centre, and spread and peak, or else the sigma of Eq. 1 in one of its readings."""

    x: float
    y: float
    spread: float | None = Field(None, gt=0, description="standard deviation, map units")
    peak: float = Field(1.0, gt=0, description="risk per unit length at the centre")
    sigma: float | None = Field(None, gt=0, description="sigma of Eq. 1, instead of spread and peak")
    reading: Reading = Field("membership", description="how Eq. 1 is read")

    def build(self) -> Threat:
        """Return the threat."""
        if (self.spread is None) == (self.sigma is None):
            msg = "a threat needs either spread (and peak) or sigma (and reading)"
            raise ValueError(msg)
        if self.sigma is not None:
            return Threat.from_eq1(self.x, self.y, self.sigma, reading=self.reading)
        return Threat(self.x, self.y, spread=self.spread or 0.0, peak=self.peak)


class RandomThreatsTable(_Table):
    """Threats drawn evenly over the bounds, from a seed."""

    count: int = Field(ge=1, le=10_000)
    seed: int = Field(ge=0)
    spread: Range = Field(description="least and greatest spread, map units")
    peak: Range = Field([1.0, 1.0], description="least and greatest peak")
    clear: float = Field(0.0, ge=0, description="least distance of a centre from start and goal, map units")

    def build(self, bounds: Bounds, ends: tuple[Point, Point]) -> list[Threat]:
        """Draw the threats."""
        random = np.random.default_rng(self.seed)
        threats: list[Threat] = []
        misses = 0
        while len(threats) < self.count:
            x, y = random.uniform(bounds[0], bounds[2]), random.uniform(bounds[1], bounds[3])
            spread, peak = (random.uniform(low, high) for low, high in (self.spread, self.peak))
            if min(float(np.hypot(x - a, y - b)) for a, b in ends) >= self.clear:
                threats.append(Threat(x, y, spread=spread, peak=peak))
                misses = 0
            elif (misses := misses + 1) > MOST_MISSES:
                msg = f"random_threats: no room that keeps {self.clear:g} from start and goal; lower clear"
                raise ValueError(msg)
        return threats


class NoFlyTable(_Table):
    """No-fly areas: polygons written here, and GeoJSON files beside the scenario."""

    polygons: list[Ring] = Field(default_factory=list, description="rings of corners, closed or not")
    geojson: list[str] = Field(default_factory=list, description="paths of GeoJSON files (lon/lat), from this file")


class LatticeTable(_Table):
    """The lattice of graph solvers."""

    resolution: int | Annotated[list[int], Field(min_length=2, max_length=2)] = Field(
        default=20, description="points a side"
    )
    kind: LatticeKind = "closed"


class ScenarioTable(_Table):
    """A scenario file."""

    title: str = ""
    notes: str = ""
    coordinates: Literal["plane", "lonlat"] = Field(
        "plane", description="lonlat: points are degrees, all lengths (spread, clear) are metres"
    )
    start: Pair
    goal: Pair
    k: float = Field(ge=0, description="risk weight: cost = length + k * risk")
    bounds: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        [0.0, 0.0, 1.0, 1.0], description="x_min, y_min, x_max, y_max"
    )
    improper: bool = Field(default=False, description="allow peaks above 1, to see what breaks")
    threats: list[ThreatTable] = Field(default_factory=list)
    random_threats: RandomThreatsTable | None = None
    no_fly: NoFlyTable = Field(default_factory=NoFlyTable)
    lattice: LatticeTable = Field(default_factory=LatticeTable)
    solvers: dict[str, dict[str, int | float | str | bool]] = Field(
        default_factory=dict, description="settings of solvers that suit this scenario"
    )


@dataclass(frozen=True)
class _Builder:
    """A checked table on its way to a scenario."""

    table: ScenarioTable
    folder: Path

    @cached_property
    def projection(self) -> LocalProjection | None:
        """The projection of a lon/lat scenario, centred on its bounds."""
        if self.table.coordinates == "plane":
            return None
        west, south, east, north = self.table.bounds
        return LocalProjection.centred_on((west, south, east, north))

    def point(self, pair: list[float]) -> Point:
        """Return a point in map units."""
        x, y = pair
        if self.projection is None:
            return x, y
        east, north = self.projection.forward((x, y)).tolist()
        return east, north

    def end(self, name: str) -> Point:
        """Return start or goal in map units, checked in the file's own units."""
        x, y = pair = getattr(self.table, name)
        west, south, east, north = self.table.bounds
        # bounds may span the antimeridian: then west is greater than east
        inside = west <= x <= east if west <= east else x >= west or x <= east
        if self.projection is not None and not (inside and south <= y <= north):
            msg = f"{name} {(x, y)} is outside the bounds {(west, south, east, north)}; move it, or widen the bounds"
            raise ValueError(msg)
        return self.point(pair)

    def bounds(self) -> Bounds:
        """Return the bounds in map units: for lon/lat, the least box around them."""
        west, south, east, north = self.table.bounds
        if self.projection is None:
            return west, south, east, north
        if west == east or south >= north:
            msg = f"bounds {(west, south, east, north)} are empty; south < north and west != east must hold"
            raise ValueError(msg)
        return projected_bounds((west, south, east + 360.0 * (east < west), north), self.projection)

    def no_fly(self) -> BaseGeometry | None:
        """Return all no-fly areas in map units."""
        areas: list[BaseGeometry] = [shapely.Polygon(ring) for ring in self.table.no_fly.polygons]
        for name in self.table.no_fly.geojson:
            if self.projection is None:
                msg = f'no_fly.geojson {name!r} holds longitudes and latitudes; set coordinates = "lonlat"'
                raise ValueError(msg)
            areas += [area.polygon for area in read_areas(self.folder / name)]
        if self.projection is not None:
            areas = [project_area(area, self.projection) for area in areas]
        return shapely.GeometryCollection(areas) if areas else None

    def build(self, name: str) -> Scenario:
        """Return the scenario."""
        table = self.table
        bounds = self.bounds()
        start, goal = self.end("start"), self.end("goal")
        threats = []
        for entry in table.threats:
            x, y = self.point([entry.x, entry.y])
            threats.append(entry.model_copy(update={"x": x, "y": y}).build())
        if table.random_threats is not None:
            threats += table.random_threats.build(bounds, (start, goal))
        resolution = table.lattice.resolution
        return Scenario(
            name=name,
            title=table.title,
            problem=Problem(
                start=start,
                goal=goal,
                field=RiskField(threats, improper=table.improper),
                k=table.k,
                bounds=bounds,
                no_fly=self.no_fly(),
            ),
            lattice=Lattice(
                (resolution[0], resolution[1]) if isinstance(resolution, list) else resolution,
                bounds=bounds,
                kind=table.lattice.kind,
            ),
            settings=table.solvers,
            projection=self.projection,
            notes=table.notes,
        )


def schema() -> dict[str, Any]:
    """Return the JSON schema of scenario files."""
    return ScenarioTable.model_json_schema()


def scenario_from_toml(text: str, name: str, *, folder: Path | None = None, where: str | None = None) -> Scenario:
    r"""
    Build a scenario from the text of a TOML file.

    Parameters
    ----------
    text
        The file's text.
    name
        Name of the scenario.
    folder
        Where relative paths in it start; the current folder if left out.
    where
        What error messages call the file.

    Returns
    -------
    scenario
        The scenario.

    Raises
    ------
    ScenarioError
        If the text is no TOML, a key is unknown, a value has the wrong type or the problem is malformed; the message
        names the key's path and the remedy.

    Examples
    --------
    >>> scenario_from_toml("start = [0, 0]\ngoal = [1, 1]\nk = 3", "mine").problem.k
    3.0
    """
    place = where or name
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        msg = f"{place}: not TOML that can be read: {error}"
        raise ScenarioError(msg) from error
    try:
        table = ScenarioTable.model_validate(document)
    except ValidationError as error:
        msg = f"{place}: {_first_fault(error)}"
        raise ScenarioError(msg) from error
    try:
        return _Builder(table, folder or Path()).build(name)
    except (ValueError, CglaError) as error:
        msg = f"{place}: {error}"
        raise ScenarioError(msg) from error


def shipped() -> list[str]:
    """
    List the scenarios that the toolkit ships, the paper's map first.

    Examples
    --------
    >>> shipped()[0]
    'paper'
    """
    names = sorted(file.name.removesuffix(".toml") for file in _folder().iterdir() if file.name.endswith(".toml"))
    return sorted(names, key=lambda name: name != "paper")


def load_scenario(name: str | Path) -> Scenario:
    """
    Load a shipped scenario by name, or a scenario file by path.

    Raises
    ------
    ScenarioError
        If there is none (the message offers the nearest names), or the file is malformed.

    Examples
    --------
    >>> load_scenario("paper").problem.goal
    (0.9, 0.9)
    """
    path = Path(name)
    if path.suffix.lower() == ".toml":
        text = read_text(path, str(path), "a TOML file")
        return scenario_from_toml(text, path.stem, folder=path.parent, where=str(path))
    return scenario_from_toml(shipped_text(str(name)), str(name))


def shipped_text(name: str) -> str:
    """
    Return the file of a shipped scenario.

    Raises
    ------
    ScenarioError
        If there is none of that name; the message offers the nearest.

    Examples
    --------
    >>> "k = 10.0" in shipped_text("paper")
    True
    """
    known = shipped()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
        hint = f"did you mean {' or '.join(near)}?" if near else f"shipped: {', '.join(known)}."
        msg = f"unknown scenario {name!r}; {hint} A file ends in .toml, .geojson, .map or .scen"
        raise ScenarioError(msg)
    return str((_folder() / f"{name}.toml").read_text(encoding="utf-8"))


def _folder() -> Any:  # noqa: ANN401 - importlib's Traversable moved between versions
    return resources.files("cgla_graph") / "scenarios"


def _first_fault(error: ValidationError) -> str:
    """Say in one line what is wrong first: the key's path, the fault, the value and the remedy."""
    fault = error.errors()[0]
    # pydantic names the member of a union as well; what remains is the path as the file writes it
    place = ".".join(str(part) for part in fault["loc"] if not str(part).startswith(UNION_MEMBERS))
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    if fault["type"] == "extra_forbidden":
        table = _table_at(fault["loc"][:-1])
        near = difflib.get_close_matches(str(fault["loc"][-1]), table, n=1)
        hint = f"did you mean {near[0]}?" if near else f"known keys: {', '.join(table)}"
        return f"{place}: unknown key; {hint}{more}"
    if fault["type"] == "missing":
        return f"{place}: this key is needed; add it (cgla scenarios --schema says what it holds){more}"
    return (
        f"{place}: {fault['msg']} (it is {short(fault['input'])}); cgla scenarios --schema says what is allowed{more}"
    )


def _table_at(loc: tuple[int | str, ...]) -> list[str]:
    """List the keys of the table at a place in the file."""
    tables: dict[str, type[_Table]] = {
        "threats": ThreatTable,
        "random_threats": RandomThreatsTable,
        "no_fly": NoFlyTable,
        "lattice": LatticeTable,
    }
    kind = tables.get(str(loc[0])) if loc else ScenarioTable
    return list(kind.model_fields) if kind else []
