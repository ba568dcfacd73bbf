"""
Counterexamples, stored as files that anyone can run again: graphs (JSON), maps and missions (TOML).

A map or mission is a file for ``cgla plan`` or ``cgla fly`` like any other; a graph is a matrix of weights with a
source and a target. What asks for one that is not stored raises `ClaimError`.
"""

import json
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph.errors import ClaimError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.scenarios.mission_file import MissionFile, mission_from_toml
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml

_FOLDER = resources.files("cgla_graph.comparisons.claims") / "counterexamples"


@cache
def names() -> tuple[str, ...]:
    """List the stored counterexamples: file names."""
    return tuple(sorted(entry.name for entry in _FOLDER.iterdir() if entry.name.endswith((".json", ".toml"))))


def text(name: str) -> str:
    """
    Return the content of a counterexample's file.

    Raises
    ------
    ClaimError
        If there is none of that name.
    """
    if name not in names():
        msg = f"no counterexample {name!r}; there are {', '.join(names())}"
        raise ClaimError(msg)
    return (_FOLDER / name).read_text(encoding="utf-8")


def document(name: str) -> dict[str, Any]:
    """Read a JSON file as it is."""
    found: dict[str, Any] = json.loads(text(name))
    return found


def graph(name: str) -> GraphProblem:
    """Read a graph: ``{"title": …, "weights": [[…]], "source": …, "target": …}``, null for no edge."""
    read = document(name)
    weights = [[np.inf if entry is None else entry for entry in row] for row in read["weights"]]
    built = GeometricGraph.from_matrix(np.array(weights, dtype=np.float64), labels=read.get("labels"))
    return GraphProblem(built, read["source"], read["target"])


def scenario(name: str) -> Scenario:
    """Read a map; its peaks may be above 1."""
    with _improper_allowed():
        return scenario_from_toml(text(name), Path(name).stem)


def mission(name: str) -> MissionFile:
    """Read a mission."""
    return mission_from_toml(text(name), Path(name).stem)


def improper_field(threats: Iterable[Threat]) -> RiskField:
    """Build a field that may have peaks above 1."""
    with _improper_allowed():
        return RiskField(threats, improper=True)


@contextmanager
def _improper_allowed() -> Iterator[None]:
    """Build fields with peaks above 1 without a warning: they are here to show what breaks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImproperFieldWarning)
        yield
