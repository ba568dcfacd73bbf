"""Documents: scenarios, entrants and certificates survive being written as JSON, to the last bit."""

import copy
import dataclasses
import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from exact import bits
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.documents import (
    MARK,
    Document,
    certificate_document,
    certificate_from,
    decode,
    dumps,
    encode,
    entrant_document,
    entrant_from,
    scenario_document,
    scenario_from,
)
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.errors import StudyError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import Scenario, load_scenario, shipped
from cgla_graph.testing.strategies import fields, lattices, polygons, raster_fields

START, GOAL = (0.1, 0.1), (0.9, 0.9)
#: With lone surrogates, as odd file names have them.
texts = st.text(st.characters(codec=None, exclude_categories=()), max_size=8)
numbers = st.floats() | st.integers()
scalars = st.none() | st.booleans() | numbers | texts | st.binary(max_size=3) | st.complex_numbers() | lattices()
keys = st.one_of(texts, st.integers(), st.tuples(st.integers(), texts))
values: st.SearchStrategy[Any] = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.dictionaries(texts | st.just(f"{MARK}float") | keys, inner, max_size=3)
        | st.frozensets(st.integers() | texts, max_size=3)
        | st.sets(st.integers() | texts, max_size=3)
    ),
    max_leaves=8,
)
settings = st.dictionaries(texts, values, max_size=3)


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    field = draw(fields())
    if draw(st.booleans()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            field = RiskField([*field.threats, Threat(0.1, 0.3, 1 / 3, peak=draw(st.floats(0.5, 5.0)))], improper=True)
    # start and goal keep off the areas, which are within 0 to 4
    start, goal = ((draw(st.floats(-2.0, -1e-300)), draw(st.floats(-2.0, 5.0))) for _ in range(2))
    no_fly = draw(st.none() | polygons() | st.just(shapely.Polygon()))
    return Problem(start, goal, field, draw(st.floats(0.0, 1e6)), (-2.0, -2.0, 5.0, 5.0), no_fly)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    origin = st.builds(LocalProjection, st.floats(-180.0, 180.0), st.floats(-90.0, 90.0))
    return Scenario(
        name=draw(texts),
        title=draw(texts),
        problem=dataclasses.replace(draw(problems()), projection=draw(st.none() | origin)),
        lattice=draw(lattices()),
        settings=draw(st.dictionaries(texts, settings, max_size=2)),
        y_down=draw(st.booleans()),
        notes=draw(texts),
    )


def through_json(document: Document) -> Document:
    """Write and read it as a strict reader would, which knows neither NaN nor infinity."""
    text = json.dumps(document, allow_nan=False)
    text.encode("ascii")
    read: Document = json.loads(text, parse_constant=pytest.fail)
    return read


@usual
@given(values)
def test_any_value_survives(value: object) -> None:
    assert bits(decode(through_json({"of": encode(value)})["of"])) == bits(value)


def test_bits_tells_what_equality_does_not() -> None:
    assert bits(0.0) != bits(-0.0)
    assert len({bits(value) for value in (1, 1.0, True)}) == 3
    assert bits((1,)) != bits([1])
    assert bits(math.nan) == bits(math.nan)


@usual
@given(scenarios())
def test_any_scenario_survives(scenario: Scenario) -> None:
    document = scenario_document(scenario)
    again = scenario_from(through_json(document))
    assert bits(again) == bits(scenario)
    assert dumps(scenario_document(again)) == dumps(document)


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_survives(name: str) -> None:
    # (what was said of its areas when it was read is not stored)
    scenario = dataclasses.replace(load_scenario(name), area_records=())
    again = scenario_from(through_json(scenario_document(scenario)))
    assert bits(again) == bits(scenario)
    assert again.problem == scenario.problem
    # without rasters, documents equal those of earlier versions
    assert ("rasters" in scenario_document(scenario)["problem"]) == bool(scenario.problem.field.rasters)


def test_a_grid_map_survives_with_the_lattice_in_its_settings(tmp_path: Path) -> None:
    grid = tmp_path / "tiny.map"
    grid.write_text("type octile\nheight 3\nwidth 4\nmap\n....\n.@@.\n....\n", encoding="utf-8")
    rows = tmp_path / "tiny.scen"
    lines = [f"0\ttiny.map\t4\t3\t0\t0\t{x}\t2\t3.0" for x in (1, 2)]
    rows.write_text("\n".join(["version 1", *lines]), encoding="utf-8")
    both = list(open_scenarios(f"{rows}"))
    again = [scenario_from(through_json(scenario_document(one))) for one in both]
    assert [bits(one) for one in again] == [bits(one) for one in both]
    assert isinstance(again[0].settings["eight-direction"]["resolution"], Lattice)
    assert again[0].y_down
    # rows of one map share the area and its cached results
    assert again[0].problem.no_fly is again[1].problem.no_fly


def test_an_improper_field_warns_once_when_it_is_made_and_not_when_it_is_read() -> None:
    with pytest.warns(UserWarning, match="peak above 1"):
        field = RiskField([Threat(0.5, 0.5, 0.1, peak=3.0)], improper=True)
    scenario = dataclasses.replace(load_scenario("paper"), problem=Problem((0, 0), (1, 1), field, 1.0))
    # a warning would be an error
    again = scenario_from(through_json(scenario_document(scenario)))
    assert again.problem.field == field
    assert again.problem.field.improper


def test_heights_and_reference_systems_of_an_area_survive() -> None:
    area = shapely.set_srid(shapely.Polygon([(0.2, 0.2, 7.0), (0.4, 0.2, 7.5), (0.3, 0.1 + 0.2, 8.0)]), 4326)
    scenario = dataclasses.replace(load_scenario("paper"), problem=Problem((0, 0), (1, 1), no_fly=area))
    again = scenario_from(through_json(scenario_document(scenario))).problem.no_fly
    assert shapely.to_wkt(again, rounding_precision=-1) == shapely.to_wkt(area, rounding_precision=-1)
    assert shapely.get_srid(again) == 4326


@usual
@given(texts, texts, settings, st.dictionaries(texts, numbers, max_size=2), st.booleans())
def test_any_entrant_survives(
    label: str, name: str, told: dict[str, Any], budget: dict[str, float], refine: bool
) -> None:
    entrant = Entrant(label, name, told, budget, refine)
    assert bits(entrant_from(through_json(entrant_document(entrant)))) == bits(entrant)


@usual
@given(st.lists(st.floats(), min_size=5, max_size=5), st.integers(0), texts)
def test_any_certificate_survives_without_its_grids(some: list[float], cells: int, message: str) -> None:
    lower, upper, tolerance, spacing, seconds = some
    certificate = Certificate(lower, upper, tolerance, spacing, cells, message, seconds)
    assert bits(certificate_from(through_json(certificate_document(certificate)))) == bits(certificate)


def test_numpy_scalars_become_plain_numbers() -> None:
    told = {"n": np.int64(3), "x": np.float64(0.1), "yes": np.bool_(1), "far": np.float64(math.inf)}
    entrant = Entrant("mine", "mine", told)
    again = entrant_from(through_json(entrant_document(entrant))).settings
    assert again == told
    assert [type(value) for value in again.values()] == [int, float, bool, float]


@pytest.mark.parametrize("odd", [object(), ..., np.zeros(3), lambda: None])
def test_a_setting_that_no_document_holds_is_refused_by_name(odd: object) -> None:
    entrant = Entrant("mine", "mine", {"odd": [1, odd]})
    with pytest.raises(StudyError, match=r"^mine: .* is of type .*, which no study holds; give numbers"):
        entrant_document(entrant)
    scenario = dataclasses.replace(load_scenario("paper"), settings={"mine": {"odd": odd}})
    with pytest.raises(StudyError, match=r"^paper: solvers.mine: .* is of type"):
        scenario_document(scenario)


def damages(document: Any) -> list[Any]:  # noqa: ANN401 - any part of a document
    """List documents of which one part is missing, or something else."""
    if not isinstance(document, dict):
        return []
    harmed = []
    for key, part in document.items():
        without = {name: item for name, item in document.items() if name != key}
        harmed.append(without)
        harmed += [{**document, key: odd} for odd in damages(part)]
        if key not in {"y_down", "improper", "refine"}:
            harmed += [{**document, key: odd} for odd in (3.5, {f"{MARK}what": 1}, [[None]])]
    return harmed


def test_a_damaged_document_is_one_error() -> None:
    scenario = scenario_document(load_scenario("needle" if "needle" in shipped() else shipped()[-1]))
    n_refused = 0
    for damaged in damages(copy.deepcopy(scenario)):
        try:
            scenario_from(damaged)
        except StudyError as error:
            n_refused += 1
            assert "is malformed" in str(error)  # noqa: PT017 - some damages leave a document
            assert "\n" not in str(error)  # noqa: PT017 - the same
    assert n_refused > 20
    for damaged in (None, [], 3, {}, {"label": "x"}):
        with pytest.raises(StudyError, match="is malformed"):
            entrant_from(damaged)  # type: ignore[arg-type]
        with pytest.raises(StudyError, match="is malformed"):
            certificate_from(damaged)  # type: ignore[arg-type]


def test_equal_documents_are_equal_texts() -> None:
    assert dumps({"a": 1, "b": [2]}) == dumps({"b": [2], "a": 1})
    first, second = Entrant("x", "x", {"a": 1, "b": 2}), Entrant("x", "x", {"b": 2, "a": 1})
    assert dumps(entrant_document(first)) == dumps(entrant_document(second))


@given(raster_fields())
def test_rasters_survive_to_the_last_bit(field: RiskField) -> None:
    problem = Problem(START, GOAL, field, k=2.0)
    scenario = Scenario("people", "", problem, Lattice(3, bounds=problem.bounds))
    back = scenario_from(json.loads(dumps(scenario_document(scenario)))).problem
    assert back == problem
    for old, new in zip(field.rasters, back.field.rasters, strict=True):
        assert bits(new.values) == bits(old.values)
        assert (new.bounds, new.interpolation, new.origin, new.scale, new.nodata) == (
            *(old.bounds, old.interpolation, old.origin, old.scale, old.nodata),
        )


def test_cells_without_data_stay_without() -> None:
    raster = RasterRisk([[np.nan, 1.0]], (0, 0, 1, 1), nodata=0.5)
    problem = Problem(START, GOAL, RiskField(rasters=[raster]))
    back = scenario_from(scenario_document(Scenario("people", "", problem, Lattice(3, bounds=problem.bounds))))
    assert back.problem.field.rasters[0].missing.tolist() == [[True, False]]
    assert back.problem.field.rasters[0].nodata == 0.5


def test_damaged_values_of_a_raster_are_refused() -> None:
    problem = Problem(START, GOAL, RiskField(rasters=[RasterRisk([[1.0]], (0, 0, 1, 1))]))
    document = scenario_document(Scenario("people", "", problem, Lattice(3, bounds=problem.bounds)))
    document["problem"]["rasters"][0]["values"] = "AAAA"
    with pytest.raises(StudyError, match="malformed"):
        scenario_from(document)
