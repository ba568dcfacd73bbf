"""Scenarios, entrants and certificates as JSON documents, exact to the last bit."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, TypeAlias, TypeVar, cast

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.codec import decode, encode, lattice_document, lattice_from
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.errors import CglaError, StudyError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.projection import LocalProjection
from cgla_graph.scenarios.scenario import Scenario

#: What `json` reads and writes.
Document: TypeAlias = dict[str, Any]
T = TypeVar("T")


def scenario_document(scenario: Scenario) -> Document:
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
            "threats": [[threat.x, threat.y, threat.spread, threat.peak] for threat in problem.field.threats],
            "improper": problem.field.improper,
            "no_fly": None if problem.no_fly is None else _hexadecimal(problem.no_fly),
        },
        "lattice": lattice_document(scenario.lattice),
        "projection": None if scenario.projection is None else _origin(scenario.projection),
        "settings": {
            str(solver): _settings_document(settings, f"{scenario.name}: solvers.{solver}")
            for solver, settings in scenario.settings.items()
        },
    }


def scenario_from(document: Document) -> Scenario:
    """
    Build the scenario of a document; areas of equal documents are one geometry.

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


def _scenario(document: Document) -> Scenario:
    given = document["problem"]
    threats = [Threat(x, y, spread=spread, peak=peak) for x, y, spread, peak in given["threats"]]
    # the warning of a field that is no probability was given when the scenario was made
    field = RiskField(improper=True).with_only(threats) if given["improper"] else RiskField(threats)
    return Scenario(
        name=_text(document["name"]),
        title=_text(document["title"]),
        problem=Problem(
            start=given["start"],
            goal=given["goal"],
            field=field,
            k=given["k"],
            bounds=given["bounds"],
            no_fly=None if given["no_fly"] is None else _geometry(_text(given["no_fly"])),
        ),
        lattice=lattice_from(document["lattice"]),
        settings={solver: _settings(settings) for solver, settings in document["settings"].items()},
        projection=None if document["projection"] is None else LocalProjection(*document["projection"]),
        y_down=bool(document["y_down"]),
        notes=_text(document["notes"]),
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
    Build the entrant of a document; whether its solver is known here is not asked.

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


_NUMBERS = ("lower_bound", "upper_bound", "tolerance", "spacing", "seconds")


def certificate_document(certificate: Certificate) -> Document:
    """
    Turn a certificate into a document, without its grids: they are for pictures of one proof.

    Examples
    --------
    >>> certificate_document(Certificate(1.0, float("inf"), 0.1, 0.5, 4, "why", 0.1))["upper_bound"]
    {'!float': 'inf'}
    """
    numbers: Document = {name: encode(float(getattr(certificate, name))) for name in _NUMBERS}
    return {**numbers, "cells": int(certificate.cells), "message": str(certificate.message)}


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
    return Certificate(**numbers, cells=int(document["cells"]), message=_text(document["message"]))


def _settings_document(settings: Mapping[str, Any], place: str) -> Any:  # noqa: ANN401 - any JSON value
    try:
        return encode(settings)
    except StudyError as error:
        msg = f"{place}: {error}"
        raise StudyError(msg) from error


def _settings(document: object) -> dict[str, Any]:
    settings = decode(document)
    if not isinstance(settings, dict):
        msg = f"settings are {document!r}"
        raise TypeError(msg)
    return settings


def _origin(projection: LocalProjection) -> list[float]:
    return [projection.longitude, projection.latitude]


def _hexadecimal(geometry: BaseGeometry) -> str:
    """Write an area as well-known binary, which keeps every bit of its coordinates."""
    return str(shapely.to_wkb(geometry, hex=True, byte_order=1, include_srid=True))


@lru_cache(maxsize=16)
def _geometry(hexadecimal: str) -> BaseGeometry:
    """Read an area; that of many scenarios on one map is one geometry."""
    return shapely.from_wkb(hexadecimal)


def _text(value: object) -> str:
    if not isinstance(value, str):
        msg = f"{value!r} is no text"
        raise TypeError(msg)
    return value


def _built(kind: str, document: Document, build: Callable[[Document], T]) -> T:
    """Build something of a document; whatever is wrong with it is one error."""
    try:
        return build(document)
    except (CglaError, shapely.GEOSException, LookupError, TypeError, ValueError, AttributeError) as error:
        # it may be no document at all
        given = cast("object", document)
        what = given.get("name", given.get("label", "")) if isinstance(given, dict) else ""
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        msg = f"the document of {kind} {what!r} is malformed ({reason}); restore the file from a copy"
        raise StudyError(msg) from error
