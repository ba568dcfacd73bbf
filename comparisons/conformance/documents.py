"""Input and output of a planner: two JSON documents, their versions and schemas."""

from typing import Annotated, Any, Literal

import shapely
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cgla_graph._text import shown
from cgla_graph._types import Bounds
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import Interpolation, RasterRisk
from cgla_graph.scenarios.table_faults import faults

#: Version of both documents. It changes if a planner that reads the older version would go wrong.
VERSION: Literal[1] = 1

#: The command that prints both schemas.
SCHEMA = "cgla conform --schema"

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Ring = Annotated[list[Pair], Field(min_length=3)]
Box = Annotated[list[float], Field(min_length=4, max_length=4)]
Polygon = Annotated[list[Ring], Field(min_length=1)]


class Document(BaseModel):
    """A part of a document: no unknown keys, no conversion of types, no infinite numbers."""

    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, json_schema_serialization_defaults_required=True
    )


class ThreatEntry(Document):
    """A threat: risk per unit length ``peak * exp(-((x' - x)^2 + (y' - y)^2) / (2 spread^2))`` at ``(x', y')``."""

    x: float
    y: float
    spread: float = Field(gt=0, description="standard deviation, map units")
    peak: float = Field(gt=0, le=1, description="risk per unit length at the centre")


class RasterEntry(Document):
    """Risk per unit length on a grid of cells, which is added to that of the threats; 0 outside the bounds."""

    bounds: Box = Field(description="x_min, y_min, x_max, y_max: the outer edges of the outer cells")
    interpolation: Interpolation = Field(
        description="nearest: a value holds on its whole cell, on the edge of two cells the lesser one; bilinear: "
        "values hold at the centres of cells, bilinear between them, constant across the outer half cells"
    )
    values: Annotated[list[list[Annotated[float, Field(ge=0)]]], Field(min_length=1)] = Field(
        description="rows of cells, the first at y_min; in a row, the first at x_min"
    )


class LonLat(Document):
    """The place of a problem on the Earth, for information: the problem itself is in the plane."""

    origin: Pair = Field(
        description="longitude and latitude of (0, 0) in the azimuthal equidistant projection of WGS84, in metres"
    )
    start: Pair = Field(description="longitude, latitude")
    goal: Pair = Field(description="longitude, latitude")
    threats: list[Pair] = Field(description="longitudes and latitudes of the threats' centres")
    no_fly: list[Polygon] = Field(description="longitudes and latitudes of the corners of the no-fly polygons")


class ProblemDocument(Document):
    """
    A problem, as a planner gets it on its standard input: a path from start to goal at least ``length + k * risk``.

    Examples
    --------
    >>> problem = ProblemDocument(name="straight", start=[0, 0], goal=[3, 4], bounds=[0, 0, 5, 5], k=1)
    >>> problem.build().evaluate([(0, 0), (3, 4)]).cost
    5.0
    """

    version: Literal[1] = Field(VERSION, description="of this document")
    name: str = Field(description="of the instance")
    start: Pair = Field(description="x, y; map units")
    goal: Pair = Field(description="x, y; map units")
    bounds: Box = Field(description="x_min, y_min, x_max, y_max: no path leaves them; their edges may be used")
    k: float = Field(ge=0, description="risk weight: cost = length + k * risk")
    threats: list[ThreatEntry] = Field(
        default_factory=list, description="together they have the risk 1 - product(1 - risk of each)"
    )
    rasters: list[RasterEntry] = Field(default_factory=list, description="their risks are added to that of the threats")
    no_fly: list[Polygon] = Field(
        default_factory=list,
        description="polygons that no path may cross, boundaries may be touched: each a list of rings, first the "
        "outline, then its holes; a ring is a list of corners, the first not repeated. The inner parts of polygons "
        "do not meet; polygons may reach beyond the bounds",
    )
    lonlat: LonLat | None = Field(None, description="where it is on the Earth; null for a map in the plane")

    def build(self) -> Problem:
        """
        Return the problem for the oracle.

        Raises
        ------
        ProblemError
            If it is invalid, such as a start outside the bounds.
        """
        rasters = [
            RasterRisk(one.values, _box(one.bounds), interpolation=one.interpolation, origin="lower")
            for one in self.rasters
        ]
        threats = [Threat(one.x, one.y, one.spread, one.peak) for one in self.threats]
        polygons = [shapely.Polygon(outer, holes) for outer, *holes in self.no_fly]
        return Problem(
            (self.start[0], self.start[1]),
            (self.goal[0], self.goal[1]),
            RiskField(threats, rasters=rasters),
            self.k,
            _box(self.bounds),
            shapely.GeometryCollection(polygons) if polygons else None,
        )


class AnswerDocument(Document):
    """
    A planner's answer on its standard output; other keys are ignored.

    Examples
    --------
    >>> read_answer('{"path": [[0, 0], [3, 4]]}').path
    [[0.0, 0.0], [3.0, 4.0]]
    """

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False)

    path: Annotated[list[Pair], Field(min_length=1)] | None = Field(
        description="waypoints from start to goal, joined by straight segments; null where the planner finds no path"
    )
    cost: float | None = Field(None, description="cost that the planner computed; it is compared with the true cost")
    lower_bound: float | None = Field(
        None, description="lower bound that the planner claims for every path; a false bound is a wrong answer"
    )


def _box(four: list[float]) -> Bounds:
    x_min, y_min, x_max, y_max = four
    return x_min, y_min, x_max, y_max


def rings_of(areas: shapely.geometry.base.BaseGeometry) -> list[list[list[list[float]]]]:
    """
    Write polygons as documents have them.

    Examples
    --------
    >>> rings_of(shapely.box(0, 0, 1, 2))
    [[[[1.0, 0.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]]]]
    """
    return [
        [shapely.get_coordinates(ring)[:-1].tolist() for ring in (one.exterior, *one.interiors)]
        for one in shapely.get_parts(areas)
    ]


def read_problem(text: str) -> ProblemDocument:
    """
    Read a problem.

    Raises
    ------
    ScenarioError
        If it is invalid; the message names the key and the value.

    Examples
    --------
    >>> read_problem('{"version": 1, "name": "a", "start": [0, 0], "goal": [1, 1], "bounds": [0, 0, 1, 1], "kk": 1}')
    Traceback (most recent call last):
    cgla_graph.errors.ScenarioError: the problem: kk: unknown key; did you mean k?
    """
    try:
        document = ProblemDocument.model_validate_json(text)
        document.build()
    except ValidationError as error:
        msg = f"the problem: {faults(error, ProblemDocument, SCHEMA)}"
        raise ScenarioError(msg) from error
    except ProblemError as error:
        msg = f"the problem: {error}"
        raise ScenarioError(msg) from error
    return document


def read_answer(text: str) -> AnswerDocument:
    """
    Read what a planner wrote.

    Raises
    ------
    CglaError
        If it is no answer; the message shows the text that was read.

    Examples
    --------
    >>> read_answer("hello")
    Traceback (most recent call last):
    cgla_graph.errors.CglaError: standard output is no JSON (expected value at line 1 column 1): it begins with 'hello'
    """
    try:
        return AnswerDocument.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        if first["type"] == "json_invalid":
            begin = " ".join(text.split())[:40]
            why = first["ctx"]["error"]
            msg = f"standard output is no JSON ({why}): it begins with {shown(begin)}" if begin else "it wrote nothing"
        else:
            msg = faults(error, AnswerDocument, SCHEMA)
        raise CglaError(msg) from error


def conformance_schema() -> dict[str, Any]:
    """
    Return the JSON schemas of both documents, under the keys ``problem`` and ``answer``.

    Examples
    --------
    >>> sorted(conformance_schema())
    ['answer', 'problem', 'version']
    """
    return {
        "version": VERSION,
        "problem": ProblemDocument.model_json_schema(mode="serialization"),
        "answer": AnswerDocument.model_json_schema(mode="validation"),
    }
