"""The corridor contains every path within a part of the optimum; ways around its holes; what is shown is certain."""

import csv
import io
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import a_part_of, examples
from test_certificate import good_path, some_paths
from test_through import DRAWS, best_through

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate.corridor_files import save_corridor
from cgla_graph.certificate.through import grids_through
from cgla_graph.certificate.ways import Gates
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.refine.refine import refine_path
from cgla_graph.testing import strategies as drawn

FEW = 20_000
TWO_WAYS = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.4, 0.6, 0.62))


def corridor_of(problem: cg.Problem, delta: float, max_cells: int = FEW) -> cg.Corridor:
    return cg.lower_bound(problem, 0.01, max_cells=20_000).corridor(delta, max_cells=max_cells)


def near_paths(problem: cg.Problem, found: cg.Corridor, rng: np.random.Generator, count: int) -> Iterator[FloatArray]:
    """Make paths near the optimum: of solvers, over random places of the corridor and beside it, and shaken ones."""
    known = some_paths(problem, rng)
    yield from known
    if found.outer.is_empty:
        return
    low, high = np.reshape(found.outer.bounds, (2, 2))
    margin = 0.1 * (high - low)
    for place in rng.uniform(low - margin, high + margin, (count, 2)):
        yield from best_through(problem, np.clip(place, problem.bounds[:2], problem.bounds[2:]))
    sides = np.subtract(problem.bounds[2:], problem.bounds[:2])
    for path in (found.path, *known[:2]):
        if path is None or len(path) < 2:
            continue
        dense = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), 0.02 * float(sides.max())))
        for size in 10.0 ** rng.uniform(-4.0, -1.0, count):
            along = np.linspace(0.0, math.pi, len(dense))
            wave = sum(rng.standard_normal(2) * np.sin(n * along)[:, None] / n for n in range(1, 6))
            yield np.clip(dense + size * sides * wave, problem.bounds[:2], problem.bounds[2:])


def check_corridor(problem: cg.Problem, seed: int, count: int = 3, *, larger: float = 1.0) -> int:
    """Hold a corridor against paths within delta of the best one known (times `larger`); return how many there were."""
    rng = np.random.default_rng(seed)
    delta = float(rng.choice([0.0, 0.001, 0.01, 0.05, 0.3]))
    found = corridor_of(problem, delta)
    assert found.lower_bound <= found.upper_bound
    assert found.outer.is_valid
    slack = 1e-6 * max(np.subtract(problem.bounds[2:], problem.bounds[:2]))
    inside = 0
    for path in near_paths(problem, found, rng, count):
        judged = problem.evaluate(path)
        if judged.feasible and judged.cost <= larger * (1.0 + delta) * found.upper_bound:
            inside += 1
            line = shapely.LineString(path) if len(path) > 1 else shapely.Point(path[0])
            assert shapely.covers(shapely.buffer(found.outer, slack), line)
    for path in found.shown:
        assert problem.evaluate(path).cost <= (1.0 + delta) * found.lower_bound * (1.0 + 1e-12)
    for way in (*found.ways.known, *found.ways.undecided):
        assert way.lower_bound <= way.cost
        assert way.path is None or problem.evaluate(way.path).cost == pytest.approx(way.cost, rel=1e-12)
        assert way.path is None or problem.evaluate(way.path).feasible
    assert all(way.cost <= found.limit for way in found.ways.known)
    return inside


@pytest.mark.slow
@given(st.sampled_from(DRAWS), drawn.seeds)
@examples(2)
def test_no_path_within_delta_leaves_the_corridor(draw: Callable[[int], cg.Problem], seed: int) -> None:
    check_corridor(draw(seed), seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", a_part_of(range(0, 40, 8)))
def test_none_of_hundreds_of_paths_within_delta_leaves_the_corridor(first: int) -> None:
    assert sum(check_corridor(DRAWS[seed % 4](seed), seed, 25) for seed in range(first, first + 8)) > 20


def test_a_corridor_for_less_is_left_by_a_path() -> None:
    with pytest.raises(AssertionError):
        check_corridor(replace(TWO_WAYS, no_fly=None), 2, 10, larger=1.2)


def test_without_risk_the_corridor_is_an_ellipse() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5))
    delta, half = 0.05, 0.4
    long = half * (1.0 + delta)
    short = math.sqrt(long**2 - half**2)
    turn = np.linspace(0.0, 2.0 * math.pi, 721)
    ellipse = shapely.Polygon(np.column_stack([0.5 + long * np.cos(turn), 0.5 + short * np.sin(turn)]))
    found = [corridor_of(problem, delta, cells) for cells in (17_000, 60_000)]
    assert all(shapely.covers(one.outer, ellipse) for one in found)
    coarse, fine = (one.outer.area / ellipse.area - 1.0 for one in found)
    assert fine < coarse < 0.1
    assert fine < 0.04
    assert found[1].is_settled
    assert len(found[1].ways.known) == 1
    # all of it is nearly reached by paths that are shown
    assert found[1].inner.area > 0.7 * ellipse.area
    assert shapely.covers(shapely.buffer(ellipse, 0.02), found[1].inner)


def test_two_ways_around_an_area_are_two_classes() -> None:
    found = corridor_of(TWO_WAYS, 0.05)
    below, above = found.ways.known
    assert (below.passes, above.passes) == ("below 1", "above 1")
    assert below.cost == pytest.approx(2.0 * math.hypot(0.3, 0.1) + 0.2, rel=1e-9)
    assert above.cost == pytest.approx(2.0 * math.hypot(0.3, 0.12) + 0.2, rel=1e-4)
    assert above.lower_bound > below.cost
    assert not found.ways.undecided
    assert not found.ways.has_more
    assert found.ways_text() == "2"


def check_classes(problem: cg.Problem, seed: int, delta: float) -> int:
    """See that paths cost no less than the bound of their class, and that their class is listed; return how many."""
    best = cg.lower_bound(problem, 0.01, max_cells=20_000)
    found = best.corridor(delta, max_cells=FEW)
    above = math.nextafter(found.limit, math.inf)
    *_, grid = grids_through(problem, limit=above, path=best.path, max_cells=FEW)
    gates = Gates.of(problem, grid, found.outer, found.lower_bound)
    classes, more = gates.classes(found.limit, 64)
    checked = 0
    for path in near_paths(problem, found, np.random.default_rng(seed), 4):
        judged = problem.evaluate(path)
        if not judged.feasible or judged.cost > found.limit:
            continue
        passed = gates.passed_by(path)
        assert passed is not None
        assert min(gates.bound(passed), found.limit) <= judged.cost * (1.0 + 1e-9)
        # (those that wind around a hole pass a gate twice)
        assert more or passed in classes or len(set(passed)) < len(passed)
        checked += 1
    return checked


def boxes(seed: int) -> cg.Problem:
    """Draw up to six boxes and five threats between start and goal."""
    rng = np.random.default_rng(seed)
    low, sides = rng.uniform(0.15, 0.8, (6, 2)), 10.0 ** rng.uniform(-2.5, -0.6, (6, 2))
    drawn_boxes = shapely.box(*low.T, *(low + sides).T)
    places = rng.uniform(0.1, 0.9, (int(rng.integers(0, 6)), 2)).tolist()
    field = cg.RiskField([cg.Threat(x, y, spread=float(10.0 ** rng.uniform(-1.7, -0.7))) for x, y in places])
    ends = rng.uniform(0.2, 0.8, 2).tolist()
    area = shapely.union_all(drawn_boxes[: rng.integers(1, 7)])
    return cg.Problem((0.05, ends[0]), (0.95, ends[1]), field, float(rng.choice([0.0, 2.0, 10.0])), no_fly=area)


@pytest.mark.slow
def test_no_path_costs_less_than_the_bound_of_its_class() -> None:
    assert check_classes(boxes(1), 1, 0.2) > 5


@pytest.mark.slow
def test_none_of_many_paths_costs_less_than_the_bound_of_its_class() -> None:
    seeds = a_part_of(range(2, 60))
    found = sum(check_classes(boxes(seed), seed, (0.01, 0.05, 0.2, 0.5)[seed % 4]) for seed in seeds)
    assert found > 500 / 58 * len(seeds)


@pytest.mark.slow
def test_a_way_that_is_too_long_is_none() -> None:
    found = corridor_of(TWO_WAYS, 0.005)
    assert [way.passes for way in found.ways.known] == ["no hole"]


def test_a_thin_wall_has_two_sides() -> None:
    found = corridor_of(replace(TWO_WAYS, no_fly=shapely.box(0.5, 0.4, 0.5001, 0.62)), 0.1)
    assert {way.passes for way in found.ways.known} == {"below 1", "above 1"}


@pytest.mark.slow
def test_four_ways_around_two_areas_are_cut_off_at_three() -> None:
    boxes = shapely.MultiPolygon([shapely.box(0.3, 0.4, 0.35, 0.6), shapely.box(0.65, 0.4, 0.7, 0.6)])
    proof = cg.lower_bound(replace(TWO_WAYS, no_fly=boxes), 0.01)
    every, some = proof.corridor(0.2, max_cells=FEW), proof.corridor(0.2, max_cells=FEW, most_ways=3)
    assert {way.passes for way in every.ways.known} == {
        f"{one} 1, {other} 2" for one in ("above", "below") for other in ("above", "below")
    }
    assert not every.ways.has_more
    assert len(some.ways.known) == 3
    assert some.ways_text() == "at least 3"


def test_a_delta_of_zero_keeps_the_best_path() -> None:
    found = corridor_of(TWO_WAYS, 0.0)
    assert found.path is not None
    assert shapely.covers(found.outer, shapely.LineString(found.path))
    assert found.share < 0.1


def test_no_path_leaves_an_empty_corridor() -> None:
    ring = shapely.Point(0.9, 0.5).buffer(0.08).difference(shapely.Point(0.9, 0.5).buffer(0.04))
    found = corridor_of(replace(TWO_WAYS, no_fly=ring), 0.05)
    assert found.outer.is_empty
    assert found.message == "there is no path"
    assert found.ways_text() == "none"


def test_without_a_bound_no_place_is_ruled_out() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, 2.0)], improper=True)
    found = corridor_of(cg.Problem((0.1, 0.5), (0.9, 0.5), field, 1.0), 0.05)
    assert found.share == pytest.approx(1.0)
    assert found.message.startswith("no bound, so that no place is ruled out")
    assert found.ways.has_more


def test_ends_at_the_same_place_have_a_corridor() -> None:
    found = corridor_of(cg.Problem((0.5, 0.5), (0.5, 0.5)), 0.05)
    assert shapely.covers(found.outer, shapely.Point(0.5, 0.5))


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"delta": -0.1}, "delta"), ({"delta": math.inf}, "delta"), ({"most_ways": 0}, "most_ways")],
)
def test_what_makes_no_sense_is_refused(settings: dict[str, float], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        cg.lower_bound(TWO_WAYS).corridor(**settings)  # type: ignore[arg-type]


def test_a_certificate_without_a_map_says_so() -> None:
    with pytest.raises(ProblemError, match="has no map"):
        replace(cg.lower_bound(TWO_WAYS), problem=None).corridor()


def in_degrees() -> cg.Corridor:
    box = shapely.box(24.9, 60.18, 25.0, 60.24)
    return corridor_of(
        cg.Problem.in_degrees((24.8, 60.2), (25.1, 60.2), bounds=(24.7, 60.1, 25.2, 60.3), no_fly=box), 0.2
    )


def test_files_hold_the_corridor_in_degrees(tmp_path: Path) -> None:
    found = in_degrees()
    document = json.loads(save_corridor(found, tmp_path / "a.geojson").read_text())
    shapes = {one["properties"]["name"]: shapely.geometry.shape(one["geometry"]) for one in document["features"]}
    assert list(shapes) == ["corridor", "certain", "way 1", "way 2"]
    assert shapely.covers(shapely.buffer(shapes["corridor"], 1e-6), shapes["way 1"])
    assert shapes["corridor"].exterior.is_ccw
    assert 24.7 <= shapes["corridor"].bounds[0] < 24.81
    names = [one.text for one in ET.parse(save_corridor(found, tmp_path / "a.kml")).iter() if one.tag.endswith("name")]  # noqa: S314 - our own file
    assert names == ["corridor", *shapes]
    rows = list(csv.DictReader(io.StringIO(save_corridor(found, tmp_path / "a.csv").read_text())))
    assert [row["known"] for row in rows] == ["yes", "yes"]


def test_files_that_cannot_be_are_refused(tmp_path: Path) -> None:
    found = corridor_of(TWO_WAYS, 0.05)
    for name, message in (("a.kml", "needs longitudes and latitudes"), ("a.shp", "no such format")):
        with pytest.raises(OutputError, match=message):
            save_corridor(found, tmp_path / name)


def test_paths_of_solvers_are_in_the_corridor() -> None:
    problem = cg.load_scenario("paper").problem
    found = corridor_of(problem, 0.02)
    path = good_path(problem, 15)
    assert path is not None
    assert shapely.covers(found.outer, shapely.LineString(refine_path(problem, path).path))
