"""
Values, scenarios, entrants, certificates and runs of a study as JSON documents, exact to the last bit.

JSON cannot express tuples, infinity or a lattice: each becomes an object with one key that begins with ``!``, as
``{"!float": "inf"}``. So every JSON reader takes it, and reading never executes code.
"""

import base64
import dataclasses
import json
import math
import zlib
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
import scipy  # (its modules are imported when they are first used)
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import Certificate, Proof
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.metric import Better, Measure, Metric, forgotten
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError, StudyError
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.failure_model import FailureModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.rasters.crs import CoordinateSystem, CrsPlane
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.model.weights import DenseWeights, SparseWeights
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario
from cgla_graph.scenarios.scenario import Scenario

#: An object that `json` reads and writes.
Document: TypeAlias = dict[str, Any]
T = TypeVar("T")
#: First character of the keys that name a value's type.
MARK = "!"


def dumps(document: object) -> str:
    r"""
    Write a document in one line of ASCII, with sorted keys: equal documents are equal texts.

    Examples
    --------
    >>> print(dumps({"b": "é", "a": 1}))
    {"a":1,"b":"\u00e9"}
    """
    return json.dumps(document, sort_keys=True, allow_nan=False, separators=(",", ":"))


def encode(value: object) -> Any:  # noqa: ANN401 - any JSON value
    """
    Turn a value into JSON types.

    Parameters
    ----------
    value
        None, a truth value, a number, text, bytes, a `Lattice`, or a list, tuple, set or mapping of such. NumPy's
        scalars become Python's.

    Returns
    -------
    encoded
        Without NaN and infinities, which JSON lacks.

    Raises
    ------
    StudyError
        If the value, or one in it, has another type.

    Examples
    --------
    >>> encode({"a": (1, float("nan"))})
    {'a': {'!tuple': [1, {'!float': 'nan'}]}}
    """
    for kinds, write in _WRITERS:
        if isinstance(value, kinds):
            return write(value)
    kind = type(value).__name__
    msg = f"{shown(value)} is of type {kind}, which no study holds; give numbers, text or lists of these"
    raise StudyError(msg)


def decode(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    """
    Turn a result of `encode` back into the value.

    Raises
    ------
    LookupError, TypeError, ValueError
        If it was not made by `encode`.

    Examples
    --------
    >>> decode(encode({"a": (1, float("inf"))}))
    {'a': (1, inf)}
    """
    if isinstance(value, list):
        return [decode(item) for item in value]
    if not isinstance(value, dict):
        return value
    key = next(iter(value)) if len(value) == 1 else ""
    if key.startswith(MARK):
        return _READERS[key.removeprefix(MARK)](value[key])
    return {name: decode(item) for name, item in value.items()}


def lattice_document(lattice: Lattice) -> dict[str, Any]:
    """
    Turn a lattice into a document.

    Examples
    --------
    >>> lattice_document(Lattice(3, bounds=(0, 0, 1, 1)))["resolution"]
    [3, 3]
    """
    return {"resolution": list(lattice.shape), "bounds": list(lattice.bounds), "kind": lattice.kind}


def lattice_from(document: Mapping[str, Any]) -> Lattice:
    """
    Build the lattice of a document.

    Raises
    ------
    LookupError, TypeError, ValueError
        If the document is malformed.

    Examples
    --------
    >>> lattice = Lattice(3, bounds=(0, 0, 1, 1))
    >>> lattice_from(lattice_document(lattice)) == lattice
    True
    """
    columns, rows = document["resolution"]
    return Lattice((columns, rows), bounds=document["bounds"], kind=document["kind"])


def _float(value: float) -> float | dict[str, str]:
    number = float(value)
    return number if math.isfinite(number) else {f"{MARK}float": repr(number)}


def _list(value: list[Any]) -> list[Any]:
    return [encode(item) for item in value]


def _set(value: frozenset[Any] | set[Any]) -> dict[str, Any]:
    kind = "set" if isinstance(value, set) else "frozenset"
    # sets have no order
    return {f"{MARK}{kind}": sorted((encode(item) for item in value), key=dumps)}


def _mapping(value: Mapping[Any, Any]) -> dict[str, Any]:
    """Write a mapping as an object where its keys allow that, else as pairs."""
    if all(isinstance(key, str) and not key.startswith(MARK) for key in value):
        return {str(key): encode(item) for key, item in value.items()}
    return {f"{MARK}dict": [[encode(key), encode(item)] for key, item in value.items()]}


# the first type that fits counts: bool is a subclass of int
_WRITERS: tuple[tuple[type | tuple[type, ...], Callable[[Any], Any]], ...] = (
    (type(None), lambda value: value),
    (str, str),
    ((bool, np.bool_), bool),
    ((int, np.integer), int),
    ((float, np.floating), _float),
    (list, _list),
    (Mapping, _mapping),
    (tuple, lambda value: {f"{MARK}tuple": _list(list(value))}),
    ((set, frozenset), _set),
    (Lattice, lambda value: {f"{MARK}lattice": lattice_document(value)}),
    (bytes, lambda value: {f"{MARK}bytes": value.hex()}),
    (complex, lambda value: {f"{MARK}complex": [_float(value.real), _float(value.imag)]}),
)

_READERS: Mapping[str, Callable[[Any], Any]] = {
    "float": float,
    "tuple": lambda items: tuple(decode(items)),
    "set": lambda items: set(decode(items)),
    "frozenset": lambda items: frozenset(decode(items)),
    "dict": lambda pairs: {decode(key): decode(item) for key, item in pairs},
    "lattice": lattice_from,
    "bytes": bytes.fromhex,
    "complex": lambda parts: complex(*decode(parts)),
}


def scenario_document(scenario: AnyScenario) -> Document:
    """
    Turn a scenario into a document.

    Raises
    ------
    StudyError
        If a setting of a solver in it has a value that no document holds.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> scenario_document(load_scenario("paper"))["problem"]["goal"]
    [0.9, 0.9]
    """
    if isinstance(scenario, GraphScenario):
        return _on_graph_document(scenario)
    problem = scenario.problem
    return {
        "name": scenario.name,
        "title": scenario.title,
        "notes": scenario.notes,
        "y_down": bool(scenario.y_down),
        "problem": {
            "start": list(problem.start),
            "goal": list(problem.goal),
            "k": problem.k,
            "bounds": list(problem.bounds),
            **_field_document(problem.field),
            "no_fly": None if problem.no_fly is None else _hexadecimal(problem.no_fly),
            **({"clearance": problem.clearance} if problem.clearance > 0.0 else {}),
        },
        # the same without named areas
        **({"areas": [[name, _hexadecimal(area)] for name, area in scenario.areas]} if scenario.areas else {}),
        "lattice": lattice_document(scenario.lattice),
        "projection": None if scenario.projection is None else _projection_document(scenario.projection),
        "settings": _all_settings(scenario),
    }


def _all_settings(scenario: AnyScenario) -> Document:
    return {
        str(solver): _settings_document(settings, f"{scenario.name}: solvers.{solver}")
        for solver, settings in scenario.settings.items()
    }


def _field_document(field: RiskField) -> Document:
    rasters = [_raster_document(raster) for raster in field.rasters]
    return {
        "threats": [[threat.x, threat.y, threat.spread, threat.peak] for threat in field.threats],
        # without rasters the document equals that of earlier versions
        **({"rasters": rasters} if rasters else {}),
        "improper": field.improper,
    }


def _on_graph_document(scenario: GraphScenario) -> Document:
    problem = scenario.problem
    return {
        "name": scenario.name,
        "title": scenario.title,
        "notes": scenario.notes,
        "graph_name": scenario.graph_name,
        "graph": graph_text(problem.graph),
        "source": encode(problem.source),
        "target": encode(problem.target),
        "settings": _all_settings(scenario),
    }


@lru_cache(maxsize=4)
def graph_text(graph: GeometricGraph) -> str:
    """
    Write a graph as JSON in one line, exact to the last bit; pairs of one graph share the text.

    Raises
    ------
    StudyError
        If a label has a type that no document holds.
    """
    model, weights = graph.model, None
    if not graph.is_implicit:
        rows = graph.to_csgraph()
        entries = rows.tocoo()
        tails, heads = entries.coords
        weights = {
            "tails": _packed(np.asarray(tails)),
            "heads": _packed(np.asarray(heads)),
            "weights": _packed(entries.data),
            "dense": not graph.is_sparse,
        }
    # (numbers from 0 on need no list)
    labels = len(graph.labels) if graph.labels == range(len(graph.labels)) else encode(list(graph.labels))
    return dumps({
        "labels": labels,
        "positions": None if graph.positions is None else _packed(graph.positions),
        "directed": bool(graph.directed),
        "weights": weights,
        "lattice": None if graph.lattice is None else lattice_document(graph.lattice),
        "model": None if model is None else {
            **_field_document(model.field),
            "k": model.k,
            "no_fly": None if model.area.is_empty else _hexadecimal(model.area.geometry),
        },
    })  # fmt: skip


@lru_cache(maxsize=4)
def _graph(text: str) -> GeometricGraph:
    """Read a graph; scenarios on one graph share one object."""
    given = json.loads(text)
    labels = range(given["labels"]) if isinstance(given["labels"], int) else tuple(decode(given["labels"]))
    n, model, lattice = len(labels), given["model"], given["lattice"]
    positions = None if given["positions"] is None else _unpacked(given["positions"], [n, 2])
    found: dict[str, Any] = {
        "labels": labels,
        "positions": positions,
        "directed": bool(given["directed"]),
        "lattice": None if lattice is None else lattice_from(lattice),
        "model": None if model is None else _model(model),
    }
    if given["weights"] is None:
        made = GeometricGraph(**found, weights=SparseWeights(scipy.sparse.csr_array((n, n)))).under(found["model"])
        return dataclasses.replace(made, labels=labels, directed=found["directed"])
    tails, heads = (_unpacked(given["weights"][axis], [-1, 1]).ravel().astype(np.int64) for axis in ("tails", "heads"))
    entries = _unpacked(given["weights"]["weights"], [-1, 1]).ravel()
    rows = scipy.sparse.csr_array((entries, (tails, heads)), shape=(n, n))
    if not given["weights"]["dense"]:
        return GeometricGraph(**found, weights=SparseWeights(rows))
    dense = np.full((n, n), np.inf)
    np.fill_diagonal(dense, 0.0)
    dense[tails, heads] = entries
    return GeometricGraph(**found, weights=DenseWeights(dense))


def _model(document: Document) -> CostModel:
    area = None if document["no_fly"] is None else _geometry(_text(document["no_fly"]))
    return CostModel(_field(document), document["k"], area)


def scenario_from(document: Document) -> AnyScenario:
    """
    Build the scenario of a document; areas of equal documents are one geometry, and so are rasters one object.

    Raises
    ------
    StudyError
        If the document is malformed.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> paper = load_scenario("paper")
    >>> scenario_from(scenario_document(paper)).problem == paper.problem
    True
    """
    return _built("scenario", document, _scenario)


def _field(given: Document) -> RiskField:
    threats = [Threat(x, y, spread=spread, peak=peak) for x, y, spread, peak in given["threats"]]
    # the warning of an improper field was given when the scenario was made
    rasters = [_raster(dumps(raster)) for raster in given.get("rasters", ())]
    improper = bool(given["improper"])
    if not improper:
        return RiskField(threats, rasters=rasters)
    return RiskField(rasters=rasters, improper=improper).with_only(threats)


def _scenario(document: Document) -> AnyScenario:
    if "graph" in document:
        graph = _graph(_text(document["graph"]))
        return GraphScenario(
            name=_text(document["name"]),
            title=_text(document["title"]),
            problem=GraphProblem(graph, decode(document["source"]), decode(document["target"])),
            settings={solver: _settings(settings) for solver, settings in document["settings"].items()},
            notes=_text(document["notes"]),
            graph_name=_text(document["graph_name"]),
        )
    given = document["problem"]
    return Scenario(
        name=_text(document["name"]),
        title=_text(document["title"]),
        problem=Problem(
            start=given["start"],
            goal=given["goal"],
            field=_field(given),
            k=given["k"],
            bounds=given["bounds"],
            no_fly=None if given["no_fly"] is None else _geometry(_text(given["no_fly"])),
            clearance=given.get("clearance", 0.0),
            projection=None if document["projection"] is None else _projection(document["projection"]),
        ),
        lattice=lattice_from(document["lattice"]),
        settings={solver: _settings(settings) for solver, settings in document["settings"].items()},
        y_down=bool(document["y_down"]),
        notes=_text(document["notes"]),
        areas=tuple((_text(name), _geometry(_text(area))) for name, area in document.get("areas", ())),
    )


def entrant_document(entrant: Entrant) -> Document:
    """
    Turn an entrant into a document.

    Raises
    ------
    StudyError
        If a setting has a value that no document holds.

    Examples
    --------
    >>> entrant_document(Entrant.parse("rrt-star:iterations=500"))["settings"]
    {'iterations': 500}
    """
    return {
        "label": entrant.label,
        "name": entrant.name,
        "settings": _settings_document(entrant.settings, entrant.label),
        "budget": _settings_document(entrant.budget, entrant.label),
        "refine": bool(entrant.refine),
    }


def entrant_from(document: Document) -> Entrant:
    """
    Build the entrant of a document; its solver need not be installed.

    Raises
    ------
    StudyError
        If the document is malformed.

    Examples
    --------
    >>> quick = Entrant.parse("rrt-star:iterations=500")
    >>> entrant_from(entrant_document(quick)) == quick
    True
    """
    return _built("entrant", document, _entrant)


def _entrant(document: Document) -> Entrant:
    return Entrant(
        label=_text(document["label"]),
        name=_text(document["name"]),
        settings=_settings(document["settings"]),
        budget=_settings(document["budget"]),
        refine=bool(document["refine"]),
    )


def metric_document(metric: Metric) -> Document:
    """Turn a metric into a document, without its function."""
    return {"name": metric.name, "unit": metric.unit, "better": metric.better, "digest": metric.digest}


def metric_from(document: Document) -> Metric:
    """Build the metric of a document, whose function is not known any more."""
    better: Better = "more" if document["better"] == "more" else "less"
    name, unit, digest = (_text(document[key]) for key in ("name", "unit", "digest"))
    return Metric(name, forgotten, unit, better, digest)


_NUMBERS = ("lower_bound", "upper_bound", "tolerance", "spacing", "seconds")


def certificate_document(certificate: Certificate) -> Document:
    """
    Turn a certificate into a document, without its grids and its path, which only pictures of one proof need.

    Examples
    --------
    >>> certificate_document(Certificate(1.0, float("inf"), 0.1, 0.5, 4, "why", 0.1))["upper_bound"]
    {'!float': 'inf'}
    """
    numbers: Document = {name: encode(float(getattr(certificate, name))) for name in _NUMBERS}
    texts = {"message": str(certificate.message), "proof": str(certificate.proof)}
    return {**numbers, "cells": int(certificate.cells), **texts}


def certificate_from(document: Document) -> Certificate:
    """
    Build the certificate of a document.

    Raises
    ------
    StudyError
        If the document is malformed.

    Examples
    --------
    >>> certificate_from(certificate_document(Certificate(1.0, 2.0, 0.1, 0.5, 4, "why", 0.1))).gap
    1.0
    """
    return _built("certificate", document, _certificate)


def _certificate(document: Document) -> Certificate:
    numbers: dict[str, Any] = {name: float(decode(document[name])) for name in _NUMBERS}
    # (documents of earlier versions do not have the kind of proof)
    by = cast("Proof", _text(document.get("proof", "")))
    return Certificate(**numbers, cells=int(document["cells"]), message=_text(document["message"]), proof=by)


#: The numbers of an answer. Documents of earlier versions have no claimed bounds.
SOLUTION_NUMBERS = (
    *("cost", "length", "risk", "clearance", "lower_bound", "claimed_bound"),
    *("seconds", "build_seconds", "certificate_seconds"),
)


def run_document(run: Run) -> Document:
    """
    Turn a run into a document, without its scenario, entrant and certificate.

    Nodes are left out on a map, where the path says the same; of a graph they are kept, by their labels.

    Raises
    ------
    StudyError
        If a setting has a value that no document holds.
    """
    solution = run.solution
    numbers: Document = {name: encode(float(getattr(solution, name))) for name in SOLUTION_NUMBERS}
    return {
        "status": solution.status.name,
        **numbers,
        "solver": str(solution.solver),
        "evaluations": int(solution.evaluations),
        "message": str(solution.message),
        "exact": bool(run.exact),
        "settings": _settings_document(run.settings, run.solver),
        "megabytes": encode(float(run.megabytes)),
        "host": str(run.host),
        **({"measures": [[*one[:3], encode(one.value)] for one in run.measures]} if run.measures else {}),
        **({"nodes": encode(list(solution.nodes))} if isinstance(run.scenario, GraphScenario) else {}),
        "path": encode(np.asarray(solution.path, dtype=np.float64).reshape(-1, 2).tolist()),
        "trace": encode([[point.seconds, point.evaluations, point.cost] for point in solution.trace]),
    }


def run_from(
    document: Document,
    scenario: AnyScenario,
    entrant: Entrant,
    seed: int | None,
    certificate: Certificate | None,
    number: int,
) -> Run:
    """
    Build the run of a document; a malformed one raises any error.

    A plug-in proves no bound: what earlier versions stored as its `lower_bound` is a claim where the certificate does
    not prove it.
    """
    document = {"claimed_bound": encode(math.nan), **document}
    numbers: dict[str, Any] = {name: float(decode(document[name])) for name in SOLUTION_NUMBERS}
    status = Status[document["status"]]
    if not entrant.is_built_in:
        numbers |= _of_plug_in(numbers, certificate, has_path=status.has_path)
    solution = Solution(
        status=status,
        path=np.array(decode(document["path"]), dtype=np.float64).reshape(-1, 2),
        nodes=tuple(decode(document.get("nodes", []))),
        solver=_text(document["solver"]),
        evaluations=int(document["evaluations"]),
        trace=tuple([TracePoint(*point) for point in decode(document["trace"])]),
        message=_text(document["message"]),
        certificate=certificate,
        **numbers,
    )
    return Run(
        scenario=scenario,
        solver=entrant.label,
        seed=seed,
        exact=bool(document["exact"]) and entrant.is_built_in,
        solution=solution,
        certificate=certificate,
        settings=_settings(document["settings"]),
        megabytes=float(decode(document["megabytes"])),
        host=_text(document["host"]),
        number=number,
        measures=tuple(
            Measure(_text(name), _text(unit), "more" if better == "more" else "less", float(decode(value)))
            for name, unit, better, value in document.get("measures", ())
        ),
    )


def _of_plug_in(numbers: Mapping[str, float], certificate: Certificate | None, *, has_path: bool) -> dict[str, float]:
    """Return the bounds of a plug-in's stored answer: the certificate's, and the greatest finite claim."""
    proven = math.nan if certificate is None else certificate.lower_bound
    stored = numbers["lower_bound"]
    given = (numbers["claimed_bound"], stored if stored != proven else math.nan) if has_path else ()
    claim = max((claim for claim in given if math.isfinite(claim)), default=math.nan)
    return {"lower_bound": proven, "claimed_bound": claim}


def _settings_document(settings: Mapping[str, Any], place: str) -> Any:  # noqa: ANN401 - any JSON value
    try:
        return encode(settings)
    except StudyError as error:
        msg = f"{place}: {error}"
        raise StudyError(msg) from error


def _settings(document: object) -> dict[str, Any]:
    settings = decode(document)
    if not isinstance(settings, dict):
        msg = f"settings are {shown(document)}"
        raise TypeError(msg)
    return settings


def _projection_document(projection: LocalProjection) -> list[Any]:
    """Return the origin of a projection, and the system of a plane that has one."""
    origin: list[Any] = [projection.longitude, projection.latitude]
    if isinstance(projection, CrsPlane):
        system = projection.system
        around = None if system.area is None else list(system.area)
        accuracy = system.accuracy if math.isfinite(system.accuracy) else None
        origin += [
            system.wkt,
            system.name,
            around,
            accuracy,
            projection.least,
            projection.greatest,
            list(projection.bounds),
        ]
    return origin


def _projection(document: list[Any]) -> LocalProjection:
    longitude, latitude, *more = document
    if not more:
        return LocalProjection(longitude, latitude)
    wkt, name, around, accuracy, least, greatest, bounds = more
    area = None if around is None else tuple(around)
    system = CoordinateSystem(wkt, name, area, math.inf if accuracy is None else accuracy)
    return CrsPlane(longitude, latitude, system, least, greatest, tuple(bounds))


def _raster_document(raster: RasterRisk) -> Document:
    """Write a raster with its exact values."""
    return {
        "shape": list(raster.shape),
        "values": _packed(raster.values),
        "bounds": list(raster.bounds),
        "interpolation": raster.interpolation,
        "origin": raster.origin,
        "scale": raster.scale,
        "nodata": raster.nodata,
        # without people the document equals that of earlier versions
        **({} if raster.unit is None else {"unit": raster.unit}),
        **({} if raster.failures is None else {"failures": dataclasses.asdict(raster.failures)}),
        # (the known area of files in degrees, and the greatest density of their cells)
        **({} if raster.covers is None else {"covers": shapely.to_wkb(raster.covers, hex=True)}),
        **({} if raster.peaks is None else {"peaks": _packed(raster.peaks)}),
    }


def _packed(values: NDArray[Any]) -> str:
    # the same bytes for both byte orders of machines
    data = np.ascontiguousarray(values, dtype="<f8").tobytes()
    return base64.b64encode(zlib.compress(data, 6)).decode("ascii")


def _unpacked(text: str, shape: list[int]) -> FloatArray:
    try:
        data = zlib.decompress(base64.b64decode(_text(text), validate=True))
    except zlib.error as error:
        msg = f"the values of a raster are damaged ({error})"
        raise ValueError(msg) from error
    rows, columns = shape
    return np.frombuffer(data, dtype="<f8").reshape(rows, columns)


@lru_cache(maxsize=4)
def _raster(text: str) -> RasterRisk:
    """Read a raster; scenarios on one map share one object."""
    given = json.loads(text)
    values = _unpacked(given["values"], given["shape"])
    settings = {key: given[key] for key in ("interpolation", "origin", "scale", "nodata")}
    failures = FailureModel(**given["failures"]) if "failures" in given else None
    settings["covers"] = shapely.from_wkb(given["covers"]) if "covers" in given else None
    settings["peaks"] = _unpacked(given["peaks"], given["shape"]) if "peaks" in given else None
    return RasterRisk(values, given["bounds"], **settings, unit=given.get("unit"), failures=failures)


def _hexadecimal(geometry: BaseGeometry) -> str:
    """Write an area as well-known binary, which keeps every bit of its coordinates."""
    return str(shapely.to_wkb(geometry, hex=True, byte_order=1, include_srid=True))


@lru_cache(maxsize=16)
def _geometry(hexadecimal: str) -> BaseGeometry:
    """Read an area; that of many scenarios on one map is one geometry."""
    return shapely.from_wkb(hexadecimal)


def _text(value: object) -> str:
    if not isinstance(value, str):
        msg = f"{shown(value)} is no text"
        raise TypeError(msg)
    return value


def _built(kind: str, document: Document, build: Callable[[Document], T]) -> T:
    """Build something of a document; any fault becomes a `StudyError`."""
    try:
        return build(document)
    except (CglaError, shapely.GEOSException, LookupError, TypeError, ValueError, AttributeError) as error:
        # it may be no document at all
        given = cast("object", document)
        what = given.get("name", given.get("label", "")) if isinstance(given, dict) else ""
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        msg = f"the document of {kind} {shown(what)} is malformed ({reason}); restore the file from a copy"
        raise StudyError(msg) from error
