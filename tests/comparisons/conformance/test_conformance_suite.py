"""The stored instances equal those that the script makes, and their stated facts hold."""

import json
from collections import Counter
from importlib import resources

import pytest
import shapely

from cgla_graph.comparisons.conformance.documents import conformance_schema, read_problem
from cgla_graph.comparisons.conformance.families import drafts
from cgla_graph.comparisons.conformance.make import instance_of, text_of
from cgla_graph.comparisons.conformance.suite import FILE, WIDEST, chosen, suite
from cgla_graph.errors import ScenarioError


def test_every_bracket_is_narrow_and_the_stored_path_costs_its_upper_end() -> None:
    for one in suite():
        if one.path is None:
            assert one.lower_bound is one.upper_bound is None, one.name
            continue
        problem, found = one.problem.build(), one.problem.build().evaluate(one.path)
        assert found.feasible, one.name
        assert (tuple(one.path[0]), tuple(one.path[-1])) == (problem.start, problem.goal), one.name
        assert found.cost == pytest.approx(one.upper_bound, rel=1e-14), one.name
        assert 0.0 < one.lower_bound <= one.upper_bound <= one.lower_bound * (1.0 + WIDEST), one.name  # type: ignore[operator]


def test_the_suite_has_forty_problems_of_eight_families() -> None:
    assert len({one.name for one in suite()}) == 40
    assert Counter(one.family for one in suite()) == {
        "open": 5, "walls": 6, "maze": 4, "narrow": 5, "crowd": 6, "raster": 6, "lonlat": 4, "infeasible": 4,
    }  # fmt: skip
    assert [one.has_path for one in suite()] == [one.family != "infeasible" for one in suite()]
    text = resources.files("cgla_graph.comparisons.conformance").joinpath(FILE).read_text(encoding="utf-8")
    assert len(text.encode()) < 300_000
    assert text_of(list(suite())) == text


def test_the_stored_problems_are_those_that_the_script_makes() -> None:
    assert [one.problem for one in drafts()] == [one.problem for one in suite()]
    assert [(one.family, one.title) for one in drafts()] == [(one.family, one.title) for one in suite()]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open-straight", "narrow-crack", "lonlat-alps", "infeasible-ring"])
def test_brackets_come_out_again(name: str) -> None:
    """Planners and proofs may become better: both brackets hold the optimum, and so they overlap."""
    (stored,) = chosen([name])
    (draft,) = (one for one in drafts() if one.problem.name == name)
    again = instance_of(draft)
    assert again.problem == stored.problem
    assert again.has_path is stored.has_path
    if stored.lower_bound is not None and stored.upper_bound is not None:
        assert again.lower_bound is not None
        assert again.upper_bound is not None
        assert max(again.lower_bound, stored.lower_bound) <= min(again.upper_bound, stored.upper_bound)


def test_polygons_can_be_tested_one_by_one() -> None:
    """Their inner parts do not meet, and no two share an edge."""
    for one in suite():
        parts = [shapely.Polygon(outer, holes) for outer, *holes in one.problem.no_fly]
        assert all(part.is_valid for part in parts)
        assert shapely.MultiPolygon(parts).is_valid, one.name


def test_lonlat_problems_tell_where_they_are() -> None:
    for one in chosen(["lonlat"]):
        place = one.problem.lonlat
        assert place is not None
        assert len(place.threats) == len(one.problem.threats)
        assert [len(ring) for area in place.no_fly for ring in area] == [
            len(ring) for area in one.problem.no_fly for ring in area
        ]


def test_a_problem_goes_through_json_unchanged() -> None:
    for one in suite():
        assert read_problem(one.problem.model_dump_json()) == one.problem


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "version: choose 1 (it is 2)"),
        ({"start": [9, 9]}, "start (9.0, 9.0) is outside the bounds"),
        ({"kk": 1}, "kk: unknown key; did you mean k?"),
        ({"threats": [{"x": 0, "y": 0, "spread": 0, "peak": 1}]}, "threats.0.spread: give a number greater than 0"),
    ],
)
def test_what_is_no_problem_is_refused(change: dict[str, object], words: str) -> None:
    document = {**chosen(["open-one"])[0].problem.model_dump(), **change}
    with pytest.raises(ScenarioError) as caught:
        read_problem(json.dumps(document))
    assert words in str(caught.value)


def test_the_schema_tells_all_keys_of_what_is_sent() -> None:
    schema = conformance_schema()
    sent = json.loads(chosen(["lonlat-alps"])[0].problem.model_dump_json())
    assert set(schema["problem"]["required"]) == set(schema["problem"]["properties"]) == set(sent)
    assert schema["version"] == sent["version"]
    assert schema["answer"]["required"] == ["path"]
