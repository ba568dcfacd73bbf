"""Random maps: as their settings say, the same everywhere, never without a path, sorted by difficulty."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from strategies import few, usual

from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.scenarios import random_map
from cgla_graph.scenarios.drawing import Stream
from cgla_graph.scenarios.random_map import difficulty, random_scenario, random_scenarios
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml

PINNED_THREATS = [
    ("0x1.74de8b59d05b7p-1", "0x1.1839b923bce8fp-1", "0x1.d212a0e62207fp-6", 1.0),
    ("0x1.8b0e907e8cb34p-1", "0x1.02115dcc19640p-6", "0x1.c96189aff58e0p-5", 1.0),
]
PINNED_CORNERS = [
    ("0x1.73906dbc7d5f4p-2", "0x1.55a46fb253a79p-1"),
    ("0x1.f35a769ff9ed3p-2", "0x1.1d758aa280672p-1"),
    ("0x1.3ba797c61ac2ep-1", "0x1.5aca5a1e4c190p-1"),
    ("0x1.d3a67e02048bdp-2", "0x1.9defb4ec34155p-1"),
    ("0x1.73906dbc7d5f4p-2", "0x1.55a46fb253a79p-1"),
]

seeds = st.one_of(st.integers(0, 1000), st.integers(0, random_map.LARGEST_SEED))


def polygons_of(scenario: Scenario) -> list[shapely.Polygon]:
    area = scenario.problem.no_fly
    return [] if area is None else list(shapely.get_parts(area))


def optimum(scenario: Scenario) -> float:
    """Find the least cost on the complete graph by networkx."""
    laid = scenario.problem.on_lattice(scenario.lattice)
    graph = laid.graph.to_networkx()
    return nx.dijkstra_path_length(graph, laid.source, laid.target) if nx.has_path(graph, 0, laid.target) else math.inf


def small(problem: Problem, resolution: int = 5) -> Scenario:
    return Scenario("small", "", problem, Lattice(resolution, bounds=problem.bounds))


# The same everywhere


def test_a_map_is_pinned_to_the_last_bit() -> None:
    # What users publish by its seed must never change: if this fails, the code is wrong, not the numbers.
    scenario = random_scenario(17, threats=2, areas=1)
    numbers = [
        (threat.x.hex(), threat.y.hex(), threat.spread.hex(), threat.peak) for threat in scenario.problem.field.threats
    ]
    assert numbers == PINNED_THREATS
    (polygon,) = polygons_of(scenario)
    assert [(x.hex(), y.hex()) for x, y in polygon.exterior.coords] == PINNED_CORNERS


@given(seed=seeds)
@usual
def test_numbers_are_those_of_numpys_generator(seed: int) -> None:
    spawned = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed).spawn(2)[1]))
    for stream, generator in ((Stream(seed, 1), spawned), (Stream(seed), np.random.default_rng(seed))):
        assert [stream.between(-0.3, 0.5) for _ in range(20)] == generator.uniform(-0.3, 0.5, 20).tolist()


@given(seed=seeds, threats=st.integers(0, 15), areas=st.integers(0, 4), k=st.floats(0.0, 100.0))
@usual
def test_maps_of_a_seed_share_what_they_can(seed: int, threats: int, areas: int, k: float) -> None:
    scenario = random_scenario(seed, threats=threats, areas=areas, k=k)
    assert random_scenario(seed, threats=threats, areas=areas, k=k).problem == scenario.problem
    more = random_scenario(seed, threats=threats + 2, areas=areas + 1, resolution=7)
    assert more.problem.field.threats[:threats] == scenario.problem.field.threats
    assert polygons_of(more)[:areas] == polygons_of(scenario)
    assert scenario.problem.k == k
    assert (scenario.lattice.shape, more.lattice.shape) == ((20, 20), (7, 7))


@given(one=seeds, other=seeds)
def test_different_seeds_are_different_maps(one: int, other: int) -> None:
    first, second = random_scenario(one), random_scenario(other)
    assert (one == other) == (first.problem == second.problem) == (first.name == second.name)
    shared = set(first.problem.field.threats) & set(second.problem.field.threats)
    assert one == other or not shared


def test_notes_draw_the_same_map_again() -> None:
    scenario = random_scenario(3, threats=4, areas=2, k=7, spread=(0.01, 0.02), peak=(0.3, 0.5), start=(0.2, 0.1))
    call = scenario.notes.removeprefix("drawn by cgla_graph.scenarios.random_map.")
    again = eval(call, {"random_scenario": random_scenario})  # noqa: S307 - the notes are a call
    assert (again.problem, again.name, again.notes) == (scenario.problem, scenario.name, scenario.notes)


@given(seed=seeds, areas=st.integers(0, 3))
@few
def test_a_map_that_is_written_and_read_is_the_same(seed: int, areas: int) -> None:
    scenario = random_scenario(seed, areas=areas)
    problem = scenario.problem
    threats = ", ".join(
        f"{{ x = {threat.x!r}, y = {threat.y!r}, spread = {threat.spread!r}, peak = {threat.peak!r} }}"
        for threat in problem.field.threats
    )
    rings = [[list(corner) for corner in polygon.exterior.coords] for polygon in polygons_of(scenario)]
    text = f"start = {list(problem.start)}\ngoal = {list(problem.goal)}\nk = {problem.k}\nthreats = [{threats}]\n"
    read = scenario_from_toml(f"{text}[no_fly]\npolygons = {rings}\n", scenario.name)
    assert read.problem == problem
    assert read.lattice == scenario.lattice


# The distribution


@given(
    seed=seeds,
    threats=st.integers(0, 40),
    clear=st.floats(0.0, 0.3),
    spread=st.tuples(st.floats(0.001, 0.1), st.floats(0.1, 0.3)),
    peak=st.tuples(st.floats(0.1, 0.5), st.floats(0.5, 1.0)),
)
def test_threats_are_within_their_settings(
    seed: int, threats: int, clear: float, spread: tuple[float, float], peak: tuple[float, float]
) -> None:
    problem = random_scenario(seed, threats=threats, clear=clear, spread=spread, peak=peak).problem
    assert len(problem.field) == threats
    for threat in problem.field.threats:
        assert 0.0 <= threat.x < 1.0
        assert 0.0 <= threat.y < 1.0
        assert spread[0] <= threat.spread <= spread[1]
        assert peak[0] <= threat.peak <= peak[1]
        for end in (problem.start, problem.goal):
            assert math.dist((threat.x, threat.y), end) >= clear - 1e-15


def test_the_default_is_that_of_the_harness() -> None:
    problem = random_scenario(1).problem
    assert (problem.start, problem.goal, problem.k, problem.no_fly) == ((0.1, 0.1), (0.9, 0.9), 10.0, None)
    assert (len(problem.field), {threat.peak for threat in problem.field.threats}) == (10, {1.0})
    drawn = [threat for seed in range(400) for threat in random_scenario(seed).problem.field.threats]
    assert stats.kstest([threat.spread for threat in drawn], stats.uniform(0.025, 0.04).cdf).pvalue > 1e-4
    least = min(math.dist((threat.x, threat.y), end) for threat in drawn for end in ((0.1, 0.1), (0.9, 0.9)))
    assert 0.12 <= least < 0.13


def test_centres_fall_evenly_and_maps_are_independent() -> None:
    rows = np.array(
        [[(t.x, t.y) for t in random_scenario(seed, clear=0.0).problem.field.threats] for seed in range(400)]
    )
    for column in rows.reshape(-1, 2).T:
        assert stats.kstest(column, "uniform").pvalue > 1e-4
    # neighbouring seeds, neighbouring threats, and the two coordinates
    for one, other in [(rows[1:], rows[:-1]), (rows[:, 1:], rows[:, :-1]), (rows[..., 0], rows[..., 1])]:
        assert stats.pearsonr(one.ravel(), other.ravel()).pvalue > 1e-4


@given(
    seed=seeds,
    areas=st.integers(1, 5),
    radius=st.tuples(st.floats(0.01, 0.08), st.floats(0.08, 0.15)),
    clear=st.floats(0.0, 0.12),
)
def test_areas_are_convex_and_apart(seed: int, areas: int, radius: tuple[float, float], clear: float) -> None:
    scenario = random_scenario(seed, areas=areas, area_radius=radius, clear=clear)
    polygons = polygons_of(scenario)
    assert len(polygons) == areas
    ends = [shapely.Point(end) for end in (scenario.problem.start, scenario.problem.goal)]
    frame = shapely.box(0.0, 0.0, 1.0, 1.0)
    for polygon in polygons:
        assert polygon.is_valid
        assert polygon.covers(polygon.convex_hull.buffer(-1e-12))
        assert 3 <= len(polygon.exterior.coords) - 1 <= 7
        circle = shapely.minimum_bounding_radius(polygon)
        assert 0.4 * radius[0] <= circle <= radius[1] + 1e-12
        assert polygon.distance(frame.exterior) >= random_map.GAP / 2.0 - 1e-12
        assert frame.covers(polygon)
        assert min(end.distance(polygon) for end in ends) >= max(clear, random_map.GAP / 2.0) - 1e-12
        # no sliver
        assert polygon.area >= 0.1 * radius[0] ** 2
    for one, other in itertools.combinations(polygons, 2):
        assert one.distance(other) >= random_map.GAP - 1e-12


def is_joined(scenario: Scenario) -> bool:
    """Return whether lattice steps join start, goal and all points half a diagonal away from every area."""
    laid = scenario.problem.on_eight_connected(scenario.lattice)
    joined = nx.node_connected_component(laid.graph.to_networkx(), laid.source)
    far = shapely.distance(scenario.problem.no_fly, shapely.points(laid.graph.positions))
    clear = np.nonzero(far >= math.hypot(*scenario.lattice.spacing) / 2.0)[0]
    return {laid.target, *clear.tolist()} <= joined


@given(
    seed=seeds,
    areas=st.integers(1, 8),
    resolution=st.integers(20, 23),
    radius=st.sampled_from([(0.05, 0.15), (0.03, 0.08)]),
)
@few
def test_no_map_is_without_a_path(seed: int, areas: int, resolution: int, radius: tuple[float, float]) -> None:
    assert is_joined(random_scenario(seed, areas=areas, area_radius=radius, resolution=resolution))


def test_a_map_without_a_path_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    fence = shapely.box(0.3, 0.3, 0.7, 0.7).exterior.buffer(0.05, join_style="mitre")
    assert not is_joined(small(Problem((0.1, 0.1), (0.5, 0.5), no_fly=fence), 20))
    assert not is_joined(small(Problem((0.1, 0.1), (0.9, 0.9), no_fly=fence), 20))
    # areas that may overlap shut off parts of some map
    monkeypatch.setattr(random_map, "are_apart", lambda *_: True)
    starts: random_map.MapSettings = {"start": (0.0, 0.0), "goal": (1.0, 1.0), "area_radius": (0.08, 0.13)}
    assert not all(is_joined(random_scenario(seed, areas=40, **starts)) for seed in range(30))


# Difficulty


@given(seed=seeds, k=st.floats(0.0, 50.0), areas=st.integers(0, 1), resolution=st.integers(4, 9))
@few
def test_difficulty_is_the_straight_line_over_the_optimum(seed: int, k: float, areas: int, resolution: int) -> None:
    scenario = random_scenario(seed, k=k, areas=areas, resolution=resolution)
    problem = scenario.problem
    straight = problem.evaluate([problem.start, problem.goal])
    if straight.feasible:
        assert difficulty(scenario) == pytest.approx(straight.cost / optimum(scenario), rel=1e-12)
    else:
        assert difficulty(scenario) == math.inf
    assert difficulty(scenario) >= 1.0


@given(seed=seeds, resolution=st.integers(3, 6))
@few
def test_a_finer_lattice_never_lowers_difficulty(seed: int, resolution: int) -> None:
    coarse = random_scenario(seed, resolution=resolution)
    fine = random_scenario(seed, resolution=2 * resolution - 1)
    assert difficulty(fine) >= difficulty(coarse) * (1.0 - 1e-12)


def test_difficulty_in_closed_form() -> None:
    assert difficulty(random_scenario(1, k=0.0)) == 1.0
    assert difficulty(random_scenario(1, threats=0)) == 1.0
    assert difficulty(small(Problem((0.5, 0.5), (0.5, 0.5), RiskField([Threat(0.5, 0.5, 0.1)]), k=1.0))) == 1.0
    # One threat in the middle: the best of 3 x 3 points goes along two sides, far from it.
    problem = Problem((0.0, 0.0), (1.0, 1.0), RiskField([Threat(0.5, 0.5, 0.02)]), k=100.0)
    through = math.sqrt(2.0) + 100.0 * 0.02 * math.sqrt(2.0 * math.pi)
    assert difficulty(small(problem, 2)) == pytest.approx(through / 2.0, rel=1e-9)


def test_a_straight_line_through_an_area_is_infinitely_difficult() -> None:
    wall = Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.2, 0.6, 0.8))
    assert difficulty(small(wall)) == math.inf
    closed = Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, -1.0, 0.6, 2.0))
    assert difficulty(small(closed)) == math.inf
    along_the_edge = Problem((0.0, 0.5), (1.0, 0.5), no_fly=shapely.box(0.4, 0.5, 0.6, 0.8))
    assert difficulty(small(along_the_edge)) == 1.0


def test_difficulty_of_an_improper_field_is_refused() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = RiskField([Threat(0.5, 0.5, 0.1, peak=3.0)], improper=True)
    with pytest.raises(ProblemError, match=r"small: .*improper.*lower peaks"):
        difficulty(small(Problem((0.0, 0.0), (1.0, 1.0), field, k=1.0)))


def test_large_lattices_need_no_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = random_scenario(5, resolution=6)
    dense = difficulty(scenario)
    monkeypatch.setattr(random_map, "FULL_UP_TO", 10)
    assert difficulty(scenario) == dense


# Studies


def test_one_map_for_each_seed() -> None:
    scenarios = random_scenarios([5, 2, 9], areas=1, k=50.0)
    assert [scenario.name for scenario in scenarios] == [f"random-10-threats-1-area-{seed}-k50" for seed in (5, 2, 9)]
    assert [scenario.problem for scenario in scenarios] == [
        random_scenario(seed, areas=1, k=50.0).problem for seed in (5, 2, 9)
    ]
    assert scenarios[0].title == "10 random threats, 1 no-fly area"
    assert random_scenario(1, threats=1, areas=2).title == "1 random threat, 2 no-fly areas"


@pytest.mark.parametrize("each", [1, 3])
@pytest.mark.parametrize("buckets", [[1.0, 1.4, 2.0, 2.5], [1.5, 2.0], [1.0, 2.0, math.inf]])
def test_buckets_take_the_first_maps_of_their_difficulty(buckets: list[float], each: int) -> None:
    settings: random_map.MapSettings = {"areas": 1, "resolution": 6}
    found = random_scenarios(range(100), buckets=buckets, each=each, **settings)
    maps = [random_scenario(seed, **settings) for seed in range(60)]
    ratios = [difficulty(scenario) for scenario in maps]
    expected = []
    for low, high in itertools.pairwise(buckets):
        fitting = [i for i, ratio in enumerate(ratios) if low <= ratio and (ratio < high or high == math.inf)]
        expected += [(f"random-10-threats-1-area-{i}-{low:g}to{high:g}", i) for i in fitting[:each]]
    assert [(scenario.name, scenario.problem) for scenario in found] == [
        (name, maps[i].problem) for name, i in expected
    ]
    assert [scenario.title for scenario in found] == [
        f"10 random threats, 1 no-fly area, difficulty {ratios[i]:.3g}" for _, i in expected
    ]


def test_bounds_belong_to_the_upper_bucket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(random_map, "difficulty", lambda scenario: float(scenario.name.split("-")[3]))
    monkeypatch.setattr(random_map, "_ceiling", lambda *_: math.inf)
    names = [scenario.name for scenario in random_scenarios(range(1, 9), buckets=[2.0, 4.0, 5.0], each=1)]
    assert names == ["random-10-threats-2-2to4", "random-10-threats-4-4to5"]


def test_a_bucket_that_cannot_be_filled_is_named() -> None:
    with pytest.raises(ScenarioError) as caught:
        random_scenarios(range(8), buckets=[1.0, 2.0, 100.0, 200.0], each=2, resolution=4)
    message = str(caught.value)
    assert message.startswith("8 random maps did not fill the buckets of difficulty with 2 each: 1 to 2 has 2, ")
    assert "100 to 200 has 0; give more seeds (up to 2000)" in message


def test_endless_seeds_end_when_buckets_are_full_or_out_of_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = itertools.count()
    random_scenarios(numbers, buckets=[1.0, math.inf], each=3, resolution=4)
    assert next(numbers) == 3
    monkeypatch.setattr(random_map, "MOST_DRAWS", 5)
    with pytest.raises(ScenarioError, match="5 random maps did not fill"):
        random_scenarios(numbers, buckets=[100.0, 200.0], resolution=4)


def test_no_lattice_is_laid_on_maps_that_are_too_easy(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def noted(scenario: Scenario) -> float:
        tried.append(scenario)
        return difficulty(scenario)

    monkeypatch.setattr(random_map, "difficulty", noted)
    (found,) = random_scenarios(range(100), buckets=[3.0, 4.0])
    assert 1 <= len(tried) <= 0.5 * int(found.name.split("-")[3])


@given(seed=seeds, k=st.floats(0.0, 50.0), areas=st.integers(0, 1), resolution=st.integers(2, 9))
@few
def test_no_map_is_harder_than_what_lets_it_be_skipped(seed: int, k: float, areas: int, resolution: int) -> None:
    scenario = random_scenario(seed, k=k, areas=areas, resolution=resolution)
    assert difficulty(scenario) <= random_map._ceiling(scenario.problem)


# Mistakes


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: random_scenario(-1), "seed is -1; give a whole number from 0"),
        (lambda: random_scenario(2**63), "seed is 9223372036854775808"),
        (lambda: random_scenario(1, threats=10**9), "threats is 1000000000"),
        (lambda: random_scenario(1, areas=1.0), "areas is 1.0"),
        (lambda: random_scenario(1, spread=(0.2, 0.1)), r"spread is \(0.2, 0.1\).*least and the greatest"),
        (lambda: random_scenario(1, spread=(0.0, 0.1)), "both above 0"),
        (lambda: random_scenario(1, spread=0.1), r"spread is 0.1; give \(x, y\)"),
        (lambda: random_scenario(1, peak=(0.5, 1.5)), r"peak is \(0.5, 1.5\).*at most 1"),
        (lambda: random_scenario(1, area_radius=(0.1, 0.5)), r"area_radius is \(0.1, 0.5\).*at most 0.4"),
        (lambda: random_scenario(1, clear=-0.1), "clear is -0.1"),
        (lambda: random_scenario(1, clear=2.0), "no room for a threat at least 2 from start and goal; lower clear"),
        (lambda: random_scenario(1, areas=50), "no room for area .* of 50 .*draw fewer or smaller ones"),
        (lambda: random_scenario(1, start=(2.0, 0.0)), "start .*outside the bounds"),
        (lambda: random_scenario(1, goal=(0.5,)), "goal is"),
        (lambda: random_scenarios([1, 2, 1]), "seed 1 is given twice"),
        (lambda: random_scenarios([[1]]), r"seed is \[1\]"),
        (lambda: random_scenarios([1], buckets=[2.0]), r"buckets are \[2.0\]; give at least two numbers that rise"),
        (lambda: random_scenarios([1], buckets=[2.0, 2.0]), "that rise"),
        (lambda: random_scenarios([1], buckets=[0.5, 2.0]), "the first at least 1"),
        (lambda: random_scenarios([1], buckets=[1.0, math.nan]), "a bucket's bound is nan"),
        (lambda: random_scenarios([1], buckets=[1.0, 2.0], each=0), "each is 0"),
        (lambda: random_scenarios([], buckets=[1.0, 2.0]), "0 random maps did not fill"),
    ],
)
def test_mistakes_are_named(call: Callable[[], Any], words: str) -> None:
    with pytest.raises(CglaError, match=words) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    assert "\n" not in str(caught.value)
