"""Pictures: their contents, that nothing overlaps, and that files are whole and the same every time."""

import dataclasses
import re
import xml.etree.ElementTree as ET
from collections.abc import Collection
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import shapely
from figures import HOSTILE, assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import ArrayLike

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.plots.cost import trace_figure
from cgla_graph.comparisons.plots.runs import map_by_alpha, paths_of
from cgla_graph.comparisons.report.payload import scenarios_document
from cgla_graph.comparisons.statistics.intervals import path_cost
from cgla_graph.comparisons.study.rows import median_run, scenario_bound, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.plots import map as maps
from cgla_graph.plots.looks import GREY, LabelledPath
from cgla_graph.plots.map import one_line
from cgla_graph.plots.pictures import save
from cgla_graph.plots.scene import TitledProblem, risk_colours
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.solving import solve
from cgla_graph.solvers.uncertain.outlook import UncertainSolution

START, GOAL = (0.1, 0.1), (0.9, 0.9)
WHITE = pytest.approx([255] * 3, abs=1)
THREATS = RiskField([Threat(0.5, 0.5, spread=0.1, peak=0.8)])
RING = shapely.box(0.2, 0.2, 0.8, 0.8) - shapely.box(0.4, 0.4, 0.6, 0.6)


def scenario(name: str = "map", title: str = "a map", **settings: object) -> Scenario:
    extra = {key: settings.pop(key) for key in ("y_down",) if key in settings}
    problem = Problem(**({"start": START, "goal": GOAL} | settings))
    return Scenario(name, title, problem, Lattice(3, bounds=problem.bounds), **extra)


#: A map without risk or areas.
MAP = scenario()


def run(
    where: Scenario,
    solver: str = "solver",
    path: ArrayLike = (START, GOAL),
    *,
    status: Status = Status.FOUND,
    exact: bool = False,
    seed: int | None = None,
    **numbers: object,
) -> Run:
    waypoints = np.array(path, dtype=float).reshape(-1, 2)
    cost = where.problem.evaluate(waypoints).cost if len(waypoints) else np.inf
    solution = Solution(status, path=waypoints, **({"cost": cost, "seconds": 0.1} | numbers))
    return Run(where, solver, seed, exact, solution)


def traced(where: Scenario, costs: list[float], solver: str = "anytime", seed: int = 1, **numbers: object) -> Run:
    points = tuple(TracePoint(0.01 * (i + 1), i, cost) for i, cost in enumerate(costs))
    return run(where, solver, seed=seed, trace=points, **({"cost": costs[-1], "seconds": 1.0} | numbers))


def map_figure(where: Scenario, runs: list[Run], named: Collection[str] = ()) -> Figure:
    return maps.map_figure(TitledProblem.of(where), paths_of(runs, named), scenario_bound(runs))


def traces_figure(runs: list[Run], named: Collection[str] = ()) -> Figure:
    figure = trace_figure(runs, named)
    assert figure is not None
    return figure


def legend_of(figure: Figure) -> Legend:
    (legend,) = figure.legends
    return legend


def labels(figure: Figure) -> list[str]:
    return [text.get_text() for text in legend_of(figure).get_texts()]


def paths(figure: Figure) -> list[Line2D]:
    """Return the drawn paths, without start and goal, meridians and parallels."""
    return [line for line in figure.axes[0].lines if line.get_linestyle() != "None" and line.get_gid() is None]


def is_dashed(line: Line2D) -> bool:
    """Tell whether a line has gaps; matplotlib's own method says so of any line that was given a pattern."""
    return line.get_linestyle() != "None" and line._dash_pattern[1] is not None


def pixel(figure: Figure, x: float, y: float) -> list[float]:
    """Return the colour at a point of the map, 0 to 255."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    column, row = figure.axes[0].transData.transform((x, y))
    image = np.asarray(canvas.buffer_rgba())
    return image[image.shape[0] - 1 - int(row), int(column), :3].tolist()


def file_bytes(figure: Figure, path: Path) -> bytes:
    return save(figure, path).read_bytes()


# --- the map ---


def test_solvers_without_a_path_are_in_the_legend() -> None:
    statuses = [status for status in Status if not status.has_path and status is not Status.INFEASIBLE]
    # paths of refused answers are not drawn
    runs = [run(MAP, status.label, status=status, exact=True) for status in statuses]
    figure = map_figure(MAP, runs, [one.solver for one in runs])
    assert paths(figure) == []
    assert labels(figure) == [*(f"{status.label}: {status.label}" for status in statuses), "start", "goal"]
    assert_tidy(figure)


def test_a_path_of_one_point_shows_around_start_and_goal() -> None:
    where = scenario(start=START, goal=START)
    figure = map_figure(where, [run(where, "a", [START]), run(where, "b", [START, START])])
    marks = [line for line in figure.axes[0].lines if line not in paths(figure)]
    sizes = [line.get_markersize() for line in paths(figure)]
    assert len(sizes) == 1
    assert min(sizes) > max(mark.get_markersize() for mark in marks)
    assert labels(figure)[:2] == ["a: 0.0000", "b: 0.0000, same line"]
    assert_tidy(figure)


def test_an_infeasible_path_looks_different_and_is_called_so() -> None:
    where = scenario(no_fly=RING)
    figure = map_figure(where, [run(where, "good"), run(where, "bad", status=Status.INFEASIBLE)])
    good, bad = paths(figure)
    assert to_hex(bad.get_color()).upper() == "#D55E00" != to_hex(good.get_color()).upper()
    assert bad.get_linewidth() < good.get_linewidth()
    assert is_dashed(bad)
    assert not is_dashed(good)
    assert labels(figure)[:2] == ["good: 1.1314", "bad: infeasible"]


def test_a_path_that_leaves_the_bounds_is_seen_to_do_so() -> None:
    leaving = run(MAP, "bad", [START, (50.0, 0.5), GOAL], status=Status.INFEASIBLE)
    figure = map_figure(MAP, [leaving])
    assert figure.axes[0].get_xlim() == pytest.approx((0.0, 1.1))
    assert figure.axes[0].get_ylim() == pytest.approx((0.0, 1.0))
    assert pixel(figure, 1.05, 0.3) == pytest.approx([235] * 3, abs=1)
    assert_tidy(figure)


def fan(where: Scenario, count: int, status: Status = Status.FOUND) -> list[Run]:
    """Return runs of solvers whose paths and costs differ, the cheapest last."""
    ways = [[START, (0.1 + 0.02 * i, 0.9), GOAL] for i in range(count)]
    return [run(where, f"solver-{i}", way, status=status, seconds=i) for i, way in enumerate(ways)]


@pytest.mark.parametrize(("status", "count"), [(Status.FOUND, 8), (Status.FOUND, 38), (Status.INFEASIBLE, 12)])
def test_few_or_named_solvers_differ_in_colour_or_dashes(status: Status, count: int) -> None:
    """Up to eight have colours of their own."""
    where = scenario(field=THREATS, no_fly=RING)
    runs = fan(where, count, status)
    figure = map_figure(where, runs, [one.solver for one in runs if count > 8])
    assert count > 8 or not any(is_dashed(line) for line in paths(figure))
    assert len({(to_hex(line.get_color()), str(line._dash_pattern)) for line in paths(figure)}) == count
    assert len(labels(figure)) == count + 3
    assert_tidy(figure)


def test_of_many_solvers_the_best_five_and_the_named_are_in_colour() -> None:
    where = scenario(k=1.0)
    runs = [*fan(where, 28), run(where, "nothing", (), status=Status.STUCK)]
    runs += [run(where, f"wall-{i}", [START, (0.9, 0.1 * i), GOAL], status=Status.INFEASIBLE) for i in range(2)]
    for named, n_others in ((set(), 23), ({"solver-3", "solver-27"}, 22)):
        figure = map_figure(where, runs, named)
        grey = [line for line in paths(figure) if to_hex(line.get_color()) == to_hex(GREY)]
        coloured = [line for line in paths(figure) if line not in grey]
        chosen = [f"solver-{i}" for i in range(27, 22, -1)] + (["solver-3"] if named else [])
        assert [label.split(":")[0] for label in labels(figure)[: len(chosen)]] == chosen
        assert len(coloured) == len(chosen) == len({to_hex(line.get_color()) for line in coloured})
        assert len(grey) == n_others + 2
        assert max(line.get_zorder() for line in grey) < min(line.get_zorder() for line in coloured)
        others = [f"{n_others} others", "2 others, infeasible", "1 other, without a path", "start", "goal"]
        assert labels(figure)[len(chosen) :] == others
        assert_tidy(figure)
    assert "nothing: stuck" in labels(map_figure(where, runs, {"nothing"}))


QUESTION = ["cgla", "dijkstra", "rrt-star", "ompl-prm-star", "eight-direction", "bcv-style"]


def coloured(figure: Figure) -> list[str]:
    """Return the solvers that have rows of their own in the legend, in order."""
    return [label.split(": ")[0] for label in labels(figure) if ": " in label]


@pytest.mark.parametrize("suffix", ["", ":seed=3", "+refine"])
def test_of_many_solvers_those_of_the_paper_and_the_best_are_in_colour(suffix: str) -> None:
    where = scenario(k=1.0)
    names = [f"{name}{suffix}" for name in QUESTION]
    # none of them is among the best five
    runs = [run(where, name, [START, (0.01 * i, 0.9), GOAL]) for i, name in enumerate(names)] + fan(where, 12)
    figure = map_figure(where, runs)
    assert coloured(figure) == ["solver-11", *reversed(names)]
    lines = [line for line in paths(figure) if to_hex(line.get_color()) != to_hex(GREY)]
    assert len({to_hex(line.get_color()) for line in lines}) == 7
    assert labels(figure)[7] == "11 others"
    assert_tidy(figure)
    traces = traces_figure([traced(where, [one.solution.cost], one.solver) for one in runs])
    assert set(coloured(traces)) >= {*names, "solver-11"}
    assert "11 others" in labels(traces)


def test_of_many_entrants_of_a_solver_the_best_one_is_in_colour() -> None:
    where = scenario(k=1.0)
    runs = [
        dataclasses.replace(one, solution=dataclasses.replace(one.solution, solver="rrt-star" if i < 9 else "voronoi"))
        for i, one in enumerate(fan(where, 14))
    ]
    # and of those of the paper, one without a path as well; the others are the next best ones
    runs += [run(where, "cgla", (), status=Status.STUCK)]
    names = ["solver-13", "solver-12", "solver-11", "solver-8", "cgla"]
    assert coloured(map_figure(where, runs)) == names
    assert coloured(map_figure(where, runs, {"solver-0"})) == [*names[:4], "solver-0", "cgla"]


def test_thirty_solvers_have_a_short_legend_over_time_as_well() -> None:
    runs = [traced(MAP, [3.0, 1.2 + 0.01 * i], f"anytime-{i}") for i in range(15)]
    runs += [run(MAP, f"once-{i}", cost=1.1 + 0.1 * i, seconds=0.1 + i) for i in range(15)]
    figure = traces_figure(runs, {"once-14"})
    names = [label.split(":")[0] for label in labels(figure)]
    assert names == ["once-0", "anytime-0", "once-1", "anytime-1", "anytime-2", "once-14", "24 others"]
    colours = [to_hex(line.get_color()) for line in figure.axes[0].lines]
    assert colours.count(to_hex(GREY)) == 24
    assert len(set(colours)) == 7
    assert_tidy(figure)


@given(shift=st.floats(0.0, 0.009), points=st.integers(2, 50))
def test_paths_within_a_pen_are_one_line_and_no_others(shift: float, points: int) -> None:
    at = np.linspace(0.0, 1.0, points)
    path = np.stack([at, 0.3 * np.sin(3.0 * at)], axis=1)
    near, far = (path + np.array((0.0, aside)) for aside in (shift, 0.03))
    assert one_line([path, far, near], 0.01) == [[0, 2], [1]]
    # there and back again is not there
    assert one_line([path, np.concatenate([path, far[::-1]])], 0.01) == [[0], [1]]


def test_paths_within_a_pen_are_drawn_as_one() -> None:
    runs = [run(MAP, f"exact-{i}", exact=True) for i in range(4)]
    # a pen is 1.6 points wide, the map 4.8 inches
    pen = 1.6 / 72.0 / 4.8
    runs += [run(MAP, "near", [START, (0.5, 0.5 + 0.9 * pen), GOAL])]
    runs += [run(MAP, "far", [START, (0.5, 0.5 + 3.0 * pen), GOAL])]
    figure = map_figure(MAP, runs)
    assert len(paths(figure)) == 2
    assert [label.split(", ")[1:] for label in labels(figure)[:6]] == [[], *[["same line"]] * 4, []]
    assert_tidy(figure)


def test_a_line_below_another_is_wider_so_that_it_shows() -> None:
    runs = [run(MAP, "best"), run(MAP, "half", [START, (0.5, 0.5), (0.5, 0.7), GOAL])]
    runs += [run(MAP, "aside", [START, (0.1, 0.9), GOAL])]
    best, half, aside = sorted(paths(map_figure(MAP, runs)), key=Line2D.get_zorder, reverse=True)
    assert half.get_linewidth() > best.get_linewidth() == aside.get_linewidth()


def test_a_path_along_the_border_has_its_full_width() -> None:
    where = scenario(start=(0, 0), goal=(0, 1))
    figure = map_figure(where, [run(where, "a", [(0, 0), (0, 1)])])
    assert pixel(figure, -0.001, 0.5) != WHITE
    # and there is room around it, where a path inside has none
    assert figure.axes[0].get_xlim() == pytest.approx((-0.02, 1.02))
    inside = map_figure(scenario(), [run(scenario(), "a")])
    assert inside.axes[0].get_xlim() == (0.0, 1.0)


def test_the_legend_has_the_order_of_the_table() -> None:
    runs = [run(MAP, "dear", cost=1.5), run(MAP, "none", (), status=Status.NO_PATH), run(MAP, "cheap", cost=1.2)]
    figure = map_figure(MAP, runs)
    assert labels(figure)[:3] == ["cheap: 1.2000", "dear: 1.5000, same line", "none: no-path"]


def test_of_several_seeds_the_median_run_is_drawn() -> None:
    detours = [[START, (0.1, y), GOAL] for y in (0.9, 0.3, 0.6)]
    runs = [run(MAP, "seeded", path, seed=seed) for seed, path in enumerate(detours)]
    runs += [run(MAP, "unlucky", (), status=Status.NOT_FOUND, seed=seed) for seed in (1, 2)]
    runs += [run(MAP, "unlucky", seed=3)]
    runs += [run(MAP, "never", (), status=Status.NOT_FOUND, seed=seed) for seed in (1, 2)]
    figure = map_figure(MAP, runs)
    assert paths(figure)[0].get_xydata().tolist() == np.array(detours[2]).tolist()
    expected = ["seeded: 1.3544 (median of 3)", "unlucky: not-found (median of 3, 1 found)", "never: not-found"]
    assert labels(figure)[:3] == expected


def test_the_best_path_for_each_alpha_is_drawn() -> None:
    # (fails if the cheapest counts that may not be flown, or the first)
    def under(alpha: float, y: float, status: Status = Status.FOUND) -> Run:
        one = run(MAP, "s", [START, (0.5, y), GOAL], status=status)
        numbers = {item.name: getattr(one.solution, item.name) for item in dataclasses.fields(one.solution)}
        return dataclasses.replace(one, solution=UncertainSolution(**numbers, alpha=alpha))

    runs = [under(0.9, 0.9), under(0.9, 0.8), under(0.9, 0.6, Status.INFEASIBLE), under(0.0, 0.7), under(0.0, 0.95)]
    figure = map_by_alpha(runs)
    assert [label.split(":")[0] for label in labels(figure)[:2]] == ["alpha 0", "alpha 0.9"]
    assert {line.get_xydata()[1, 1] for line in paths(figure)} == {0.7, 0.8}
    alone = map_by_alpha(runs[:2])
    assert labels(alone)[0].startswith("s:")


@given(seeds=st.lists(st.sampled_from([1.0, 2.0, 3.0, 4.0, None, -1.0]), min_size=1, max_size=6), data=st.data())
def test_table_pictures_and_report_show_the_same_run(seeds: list[float | None], data: st.DataObject) -> None:
    where = scenario(bounds=(-10.0, -10.0, 10.0, 10.0))
    runs = []
    for seed, cost in enumerate(seeds):
        # a failure, a path that may not be flown, or a detour; each seed's path is another
        path = [] if cost is None else [START, (0.5, abs(cost) + 0.01 * seed), GOAL]
        status = Status.NOT_FOUND if cost is None else Status.INFEASIBLE if cost < 0.0 else Status.FOUND
        runs.append(dataclasses.replace(run(where, "a", path, status=status, seed=seed), number=seed))
    shown = median_run(runs)
    shuffled = data.draw(st.permutations(runs))
    assert median_run(shuffled) is shown
    (entry,) = paths_of(shuffled)
    assert entry.solution is shown.solution
    (cell,) = scenarios_document([shuffled], ["a"])["scenarios"][0]["cells"]
    assert cell["number"] == shown.number
    (line,) = summaries(shuffled)
    if shown.solution.status.has_path:
        assert line.cost == shown.solution.cost
        assert cell["cost"][0] == pytest.approx(line.cost, rel=1e-6)
    assert (line.length == shown.solution.length) or np.isnan(line.length) or not line.n_paths
    # no less than half of the runs are at least as good
    assert 2 * sum(path_cost(one.solution) <= path_cost(shown.solution) for one in runs) >= len(runs)


def test_risk_has_a_colour_bar_and_no_risk_has_none() -> None:
    assert len(map_figure(scenario(), []).axes) == 1
    figure = map_figure(scenario(field=THREATS), [])
    _, bar = figure.axes
    assert bar.get_ylabel() == "risk per unit length"
    assert bar.get_ylim() == pytest.approx((0.0, 0.8))
    assert pixel(figure, 0.95, 0.1) == WHITE
    assert pixel(figure, 0.5, 0.5) == pytest.approx(np.array(risk_colours()(1.0)[:3]) * 255, abs=6)


def test_a_threat_smaller_than_a_pixel_counts_on_the_colour_bar() -> None:
    figure = map_figure(scenario(field=RiskField([Threat(0.5, 0.5, spread=1e-5, peak=0.7)])), [])
    assert figure.axes[1].get_ylim() == pytest.approx((0.0, 0.7))


def test_risk_colours_get_darker_in_equal_steps_from_white() -> None:
    rgb = risk_colours()(np.linspace(0.0, 1.0, 256))[:, :3]
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    lightness = 116.0 * np.cbrt(linear @ (0.2126, 0.7152, 0.0722)) - 16.0
    assert rgb[0] == pytest.approx(1.0, abs=1e-3)
    assert np.diff(lightness) == pytest.approx(np.full(255, (38.0 - 100.0) / 255), abs=0.02)


def test_negative_risk_has_a_colour_of_its_own() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = RiskField([Threat(0.4, 0.5, 0.2, 9.0), Threat(0.6, 0.5, 0.2, 9.0)], improper=True)
    figure = map_figure(scenario(field=field), [])
    assert pixel(figure, 0.5, 0.55) == pytest.approx([0x9D, 0xB4, 0xC0], abs=2)
    assert_tidy(figure)


@pytest.mark.parametrize("y_down", [False, True])
def test_no_fly_areas_are_grey_and_their_holes_are_not(y_down: bool) -> None:
    figure = map_figure(scenario(no_fly=RING, y_down=y_down), [])
    assert pixel(figure, 0.5, 0.5) == WHITE
    assert max(pixel(figure, 0.31, 0.5)) < 230
    assert labels(figure)[-1] == "no-fly area"


def test_a_no_fly_area_ends_at_the_bounds() -> None:
    where = scenario(no_fly=shapely.box(0.5, -5, 5, 0.5))
    figure = map_figure(where, [run(where, "bad", [START, (2.0, 0.1), GOAL], status=Status.INFEASIBLE)])
    assert max(pixel(figure, 0.95, 0.3)) < 225
    assert min(pixel(figure, 1.05, 0.3)) > 230


def test_grid_maps_are_in_cells_and_y_grows_downwards() -> None:
    figure = map_figure(scenario(field=RiskField([Threat(0.5, 0.2, 0.05)]), y_down=True), [])
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (cells)", "y (cells)")
    assert axes.transData.transform((0, 0.1))[1] > axes.transData.transform((0, 0.9))[1]
    assert max(pixel(figure, 0.5, 0.2)) < 200
    assert pixel(figure, 0.5, 0.8) == WHITE
    assert_tidy(figure)


def test_maps_with_longitudes_and_latitudes_are_in_kilometres() -> None:
    where = scenario(
        start=(-9e3, 0.0),
        goal=(9e3, 0.0),
        bounds=(-1e4, -5e3, 1e4, 5e3),
        field=RiskField([Threat(0, 0, 1000)]),
        no_fly=shapely.box(-1e3, -1e3, 1e3, 1e3),
        projection=LocalProjection(24.95, -60.1),
    )
    figure = map_figure(where, [run(where, "east", ((-9e3, 0.0), (0, 3e3), (9e3, 0.0)))])
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("longitude", "latitude")
    assert axes.get_xlim() == pytest.approx((-10.0, 10.0))
    # each label stands where its meridian or parallel meets the frame
    for side, name, letters in ((0, "x", "EW"), (1, "y", "NS")):
        ticks = [*getattr(axes, f"get_{name}ticklabels")()]
        assert len(ticks) >= 2
        for tick, at in zip(ticks, getattr(axes, f"get_{name}ticks")(), strict=True):
            number, letter = tick.get_text().split("° ")
            place = (at, -5.0) if side == 0 else (-10.0, at)
            found = LocalProjection(24.95, -60.1).inverse(np.array(place) * 1e3)[side]
            assert found == pytest.approx(float(number) * (1 if letter == letters[0] else -1), abs=1e-5)
    (scale,) = [line for line in axes.lines if line.get_gid() == "scale"]
    (said,) = [text.get_text() for text in axes.texts if text.get_text().endswith(" km")]
    assert float(np.ptp(scale.get_xdata())) == pytest.approx(float(said.removesuffix(" km")))
    assert said in {"2 km", "5 km"}
    assert paths(figure)[0].get_xdata().tolist() == [-9.0, 0.0, 9.0]
    assert legend_of(figure).get_title().get_text() == "cost (km)"
    assert labels(figure)[0] == "east: 18.974"
    assert max(pixel(figure, 0.8, 0.8)) < 240
    assert_tidy(figure)


def test_of_a_large_country_the_part_around_the_flight_is_shown_with_the_names_of_its_areas() -> None:
    near, over, far = shapely.box(8e3, -2e3, 1e4, 0), shapely.box(4e3, 9e3, 6e3, 11e3), shapely.box(8e5, 0, 9e5, 1e5)
    where = dataclasses.replace(
        scenario(
            start=(0.0, 0.0),
            goal=(0.0, 2e4),
            bounds=(-1e5, -1e5, 1e6, 1e6),
            field=RiskField([Threat(0, 5e3, 1000)]),
            no_fly=shapely.GeometryCollection([near, over, far]),
            projection=LocalProjection(25.0, 60.0),
        ),
        areas=[("Near", near), ("Under the path", over), ("Far", far)],
    )
    figure = map_figure(where, [run(where, "detour", ((0, 0), (5e3, 1e4), (0, 2e4)))])
    axes = figure.axes[0]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert -8.0 < left < -1.0 and 6.0 < right < 14.0 and -6.0 < low < -1.0 and 21.0 < high < 26.0  # noqa: PT018
    assert [text.get_text() for text in axes.texts if text.get_gid() == "area"] == ["Near"]
    # its risk is drawn as finely as that of a small map
    (image,) = axes.images
    assert image.get_extent() == pytest.approx((left, right, low, high))
    assert_tidy(figure)


def test_what_is_to_be_known_of_paths_stands_beside_a_map_with_room() -> None:
    where = scenario(no_fly=RING)
    runs = bounded([run(where, "good", risk=0.25, length=1.25), run(where, "bad", status=Status.INFEASIBLE)], 1.0)
    (table,) = [text.get_text() for text in map_figure(where, runs).texts if "gap" in text.get_text()]
    head, good, _, proven = table.splitlines()
    assert head.split() == ["gap", "at", "most", "length", "risk"]
    assert good.split() == ["good", "13.14", "%", "1.2500", "0.2500"]
    assert proven == "no path costs less than 1.0000"
    many = fan(where, 30)
    crowded = map_figure(where, many, [one.solver for one in many])
    assert len(crowded.texts) == 2


@pytest.mark.parametrize(
    "width", [1e-3, 0.3, 1.0, 3.0, 1e3, *(pytest.param(width, marks=pytest.mark.slow) for width in (0.04, 2.0, 30.0))]
)
def test_thin_maps_keep_their_shape_and_a_sensible_size(width: float) -> None:
    ends = {"start": (0.0, 0.0), "goal": (width, 1.0), "bounds": (0.0, 0.0, width, 1.0)}
    where = scenario(title="a long title " * 8, field=RiskField([Threat(0.5 * width, 0.5, 0.2)]), **ends)
    runs = [run(where, f"solver-{i}", [(0.0, 0.0), (width, 1.0)]) for i in range(9)]
    figure = map_figure(where, runs)
    assert_tidy(figure)
    across, down = figure.get_size_inches()
    assert 3.0 < across < 11.0
    assert 2.5 < down < 7.5
    origin, x, y = figure.axes[0].transData.transform([(0, 0), (1, 0), (0, 1)])
    assert x[0] - origin[0] == pytest.approx(y[1] - origin[1])


@pytest.mark.parametrize("bounds", [(1e9, 1e9, 1e9 + 1, 1e9 + 1), (0, 0, 1e-7, 1e-7), (-1e30, 0, 1e30, 1e30)])
def test_coordinates_of_any_size(bounds: tuple[float, ...], tmp_path: Path) -> None:
    where = scenario(start=bounds[:2], goal=bounds[2:], bounds=bounds)
    figure = map_figure(where, [run(where, path=(bounds[:2], bounds[2:]))])
    assert_tidy(figure)
    assert file_bytes(figure, tmp_path / "map.png")


def test_the_heading_says_name_title_and_k() -> None:
    figure = map_figure(scenario(name="mine", title="what it shows", k=2.5), [])
    assert [text.get_text() for text in figure.texts] == ["mine,  k = 2.5", "what it shows"]


# --- cost over time ---


def test_no_trace_no_figure() -> None:
    never = run(MAP, "never", (), status=Status.NOT_FOUND, trace=(TracePoint(0.1, 1, np.inf),))
    assert trace_figure([]) is None
    assert trace_figure([run(MAP)]) is None
    assert trace_figure([run(MAP), never]) is None


def test_a_trace_is_a_step_line_over_logarithmic_time() -> None:
    figure = traces_figure([traced(MAP, [np.inf, 3.0, 2.0], build_seconds=1.0)])
    (line,) = figure.axes[0].lines
    assert figure.axes[0].get_xscale() == "log"
    assert line.get_drawstyle() == "steps-post"
    assert line.get_xydata() == pytest.approx(np.array([(1.02, 3.0), (1.03, 2.0), (2.0, 2.0)]))
    assert bands(figure) == []
    assert labels(figure) == ["anytime: 2.0000"]
    assert_tidy(figure)


def bands(figure: Figure) -> list[PolyCollection]:
    return [part for part in figure.axes[0].collections if isinstance(part, PolyCollection)]


def band_at(figure: Figure, seconds: float) -> tuple[float, float]:
    """Return from where to where the only band reaches at some moment."""
    (band,) = bands(figure)
    outline = shapely.Polygon(np.asarray(band.get_paths()[0].vertices)).buffer(0)
    _, low, _, high = outline.intersection(shapely.LineString([(seconds, -1e9), (seconds, 1e9)])).bounds
    return low, high


def test_of_few_seeds_the_band_is_the_range() -> None:
    runs = [
        traced(MAP, [np.inf, first, last], seed=seed) for seed, (first, last) in enumerate([(3, 1), (4, 2), (5, 3)])
    ]
    figure = traces_figure(runs)
    (line,) = figure.axes[0].lines
    assert line.get_xydata() == pytest.approx(np.array([(0.02, 4.0), (0.03, 2.0), (1.0, 2.0)]))
    assert band_at(figure, 0.025) == pytest.approx((3.0, 5.0))
    assert band_at(figure, 0.5) == pytest.approx((1.0, 3.0))
    assert labels(figure) == ["anytime: 2.0000 (median of 3)", "band: least to greatest, as runs are few"]
    assert_tidy(figure)


def test_of_enough_seeds_the_band_is_the_interval_of_the_median() -> None:
    runs = [traced(MAP, [9.0, float(seed)], seed=seed) for seed in range(1, 10)]
    figure = traces_figure(runs)
    assert band_at(figure, 0.5) == pytest.approx((2.0, 8.0))
    assert labels(figure) == ["anytime: 5.0000 (median of 9)", "band: 95 % interval of the median"]


def test_before_the_first_path_the_band_reaches_the_upper_edge() -> None:
    found = [traced(MAP, [3.0, 2.0], seed=seed) for seed in (1, 2)]
    never = [run(MAP, "anytime", (), status=Status.NOT_FOUND, seed=3)]
    figure = traces_figure(found + never)
    assert band_at(figure, 0.5) == pytest.approx((2.0, figure.axes[0].get_ylim()[1]))
    assert labels(figure)[0] == "anytime: 2.0000 (median of 3, 2 found)"
    figure = traces_figure(found[:1] + never * 2)
    (line,) = figure.axes[0].lines
    assert np.isnan(np.asarray(line.get_ydata(), dtype=float)).all()
    assert labels(figure)[0] == "anytime: not-found (median of 3, 1 found)"
    assert_tidy(figure)


def bounded(runs: list[Run], bound: float, upper: float = np.inf) -> list[Run]:
    proof = Certificate(bound, upper, 0.005, 0.1, 1, "", 0.1)
    return [dataclasses.replace(one, certificate=proof) for one in runs]


def test_with_a_lower_bound_gaps_are_drawn() -> None:
    runs = [traced(MAP, [3.0, 2.2], seed=seed) for seed in (1, 2)] + [run(MAP, "exact", exact=True, cost=2.1)]
    figure = traces_figure(bounded(runs, 2.0))
    axes = figure.axes[0]
    assert axes.get_yscale() == "log"
    assert axes.get_ylabel() == "best cost so far: gap over 2.0000"
    assert axes.lines[0].get_ydata() == pytest.approx([50.0, 10.0, 10.0])
    assert [line.get_ydata()[0] for line in axes.lines[1:]] == pytest.approx([5.0, 5.0])
    assert labels(figure)[-2:] == ["exact: 2.1000", "the optimum is in here"]
    (zone,) = axes.patches
    assert zone.get_window_extent().y1 == pytest.approx(axes.transData.transform((1.0, 5.0))[1])
    assert_tidy(figure)


def test_the_optimum_is_below_the_best_path_known_to_the_certificate() -> None:
    figure = traces_figure(bounded([traced(MAP, [3.0, 2.2])], 2.0, upper=2.18))
    (zone,) = figure.axes[0].patches
    assert zone.get_window_extent().y1 == pytest.approx(figure.axes[0].transData.transform((1.0, 9.0))[1])


def test_a_gap_of_zero_is_at_most_the_least_that_is_shown() -> None:
    figure = traces_figure(bounded([traced(MAP, [2.2, 2.0])], 2.0))
    FigureCanvasAgg(figure).draw()
    words = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert "at most 0.01 %" in words
    assert "0.01 %" not in words
    assert_tidy(figure)


@pytest.mark.parametrize("bound", [np.nan, 0.0, np.inf])
def test_a_bound_that_bounds_nothing_leaves_costs(bound: float) -> None:
    figure = traces_figure(bounded([traced(MAP, [3.0, 2.0])], bound))
    assert figure.axes[0].get_yscale() == "linear"
    assert figure.axes[0].get_ylabel() == "best cost so far"


@pytest.mark.parametrize("costs", [[2.0], [2.0, 2.0 - 1e-15], [1e12, 2.5], [2.0 + 1e-9, 2.0]])
def test_gaps_of_any_size(costs: list[float]) -> None:
    figure = traces_figure(bounded([traced(MAP, costs), traced(MAP, [2.6, 2.5], seed=2)], 2.0))
    low, high = figure.axes[0].get_ylim()
    assert 0.0 < low < high
    assert_tidy(figure)


def test_results_without_a_trace_are_marked_at_their_time() -> None:
    where = scenario(no_fly=RING)
    runs = [
        run(where, "exact-1", exact=True, cost=1.2, seconds=0.2, build_seconds=0.3),
        run(where, "exact-2", exact=True, cost=1.2 + 1e-12, seconds=0.3),
        run(where, "exact-3", exact=True, cost=1.3),
        run(where, "instant", cost=1.6, seconds=0.0),
        run(where, "huge", cost=1e6),
        run(where, "bad", cost=0.1, status=Status.INFEASIBLE),
        run(where, "none", (), status=Status.NO_PATH, exact=True),
        traced(where, [2.0, 1.5, 1.25]),
    ]
    figure = traces_figure(runs)
    axes = figure.axes[0]
    dashed = [line.get_ydata()[0] for line in axes.lines if is_dashed(line)]
    assert dashed == pytest.approx([1.2, 1.3])
    marks = {(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines if line.get_linestyle() == "None"}
    low, high = axes.get_ylim()
    assert marks == {(0.5, 1.2), (0.3, 1.2 + 1e-12), (0.1, 1.3), (1e-6, 1.6), (0.1, high)}
    assert 1.0 < low < 1.2
    assert 2.0 < high < 2.2
    expected = ["exact-2", "exact-1", "anytime", "exact-3", "instant", "huge", "exact", "exact"]
    assert [label.split(":")[0] for label in labels(figure)] == expected
    assert labels(figure)[5:] == ["huge: 1000000, above", "exact: 1.2000", "exact: 1.3000"]
    assert_tidy(figure)


@pytest.mark.parametrize("costs", [[[1e9, 2.0, 1.8, 1.0]], [[1e9, 1e8, 1.0], [2.0, 1.0], [1.5, 1.0]]])
def test_one_huge_first_cost_does_not_flatten_the_rest(costs: list[list[float]]) -> None:
    figure = traces_figure([traced(MAP, one, seed=seed) for seed, one in enumerate(costs)])
    low, high = figure.axes[0].get_ylim()
    assert 0.9 < low < 1.0
    assert 1.5 < high < 2.5


@pytest.mark.parametrize("cost", [0.0, 1.0, 1e-9, 1e12])
def test_a_trace_that_is_flat_and_began_at_once(cost: float) -> None:
    figure = traces_figure([run(MAP, trace=(TracePoint(0.0, 1, cost),), cost=cost, seconds=0.0)])
    low, high = figure.axes[0].get_ylim()
    assert low < cost < high
    assert_tidy(figure)


def test_costs_over_time_are_in_kilometres_where_the_map_is() -> None:
    where = scenario(projection=LocalProjection(25.0, 60.0))
    figure = traces_figure([traced(where, [2000.0, 1000.0])])
    assert figure.axes[0].get_ylabel() == "best cost so far (km)"
    assert labels(figure) == ["anytime: 1.0000"]


# --- names and files ---


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE, ids=lambda name: ascii(name[:12]))
def test_hostile_names_are_shown_as_they_are(name: str, tmp_path: Path) -> None:
    where = scenario(name=name, title=name)
    runs = [run(where, name), traced(where, [2.0, 1.0], solver=f"{name}?")]
    figures = map_figure(where, runs), traces_figure(runs)
    assert file_bytes(figures[0], tmp_path / "map.png")
    for figure in figures:
        assert_tidy(figure)
        assert figure.get_size_inches()[0] < 12.0
        ET.fromstring(file_bytes(figure, tmp_path / "map.svg"))  # noqa: S314 - our own file
        texts = [*legend_of(figure).get_texts(), *figure.texts]
        assert all(text.get_visible() and not text.get_parse_math() for text in texts)
        if re.fullmatch(r"[!-~]+( [!-~]+)*", name) and len(name) < 30:
            assert [text.get_text() for text in figure.texts if text.get_fontsize() > 8] == [f"{name},  k = 0", name]
            assert any(label.startswith(f"{name}: ") for label in labels(figure))


def pictures() -> list[Figure]:
    where = scenario(name="a map of ours", field=THREATS, no_fly=RING, k=3.0)
    runs = [
        run(where, "exact", exact=True),
        run(where, "bad", status=Status.INFEASIBLE),
        traced(where, [2.0, 1.9, 1.5]),
    ]
    return [map_figure(where, runs), traces_figure(runs)]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_the_same_input_gives_the_same_bytes(suffix: str, tmp_path: Path) -> None:
    first = [file_bytes(figure, tmp_path / f"first{suffix}") for figure in pictures()]
    before = dict(mpl.rcParams)
    with mpl.rc_context({"font.size": 30, "font.family": "serif", "svg.hashsalt": None, "axes.facecolor": "red"}):
        again = pictures()
        second = [file_bytes(figure, tmp_path / f"second{suffix}") for figure in again]
        third = [file_bytes(figure, tmp_path / f"second{suffix}") for figure in again]
    assert first == second == third
    assert b"<dc:date>" not in first[0]
    assert dict(mpl.rcParams) == before


def test_a_png_has_150_dots_an_inch(tmp_path: Path) -> None:
    figure = pictures()[0]
    drawn = file_bytes(figure, tmp_path / "MAP.PNG")
    size = [int.from_bytes(drawn[i : i + 4], "big") for i in (16, 20)]
    assert size == pytest.approx(150 * figure.get_size_inches(), abs=1)
    assert b"Software" not in drawn


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


def test_saving_replaces_the_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / f"{'long' * 60}.png"
    path.write_text("old")
    assert save(Figure(), path) == path
    assert path.read_bytes().startswith(b"\x89PNG")
    assert names(tmp_path) == [path.name]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("missing/map.png", "No such file"),
        ("map.gif", r"name the file \.png, \.svg or \.pdf"),
        ("map", r"name the file \.png, \.svg or \.pdf"),
        pytest.param("map.png", "nonsense", marks=pytest.mark.slow),
    ],
)
def test_what_cannot_be_saved_leaves_nothing(name: str, reason: str, tmp_path: Path) -> None:
    figure = Figure()
    if reason == "nonsense":
        figure.add_artist(Text(0.5, 0.5, "$\\nonsense$", parse_math=True))
    with pytest.raises(OutputError, match=reason) as error:
        save(figure, tmp_path / name)
    assert str(tmp_path / name) in str(error.value)
    assert "\n" not in str(error.value)
    assert "  " not in str(error.value)
    assert names(tmp_path) == []


def people(**settings: object) -> RiskField:
    values = [[1.0, 2.0, np.nan], [4.0, 0.0, 3.0]]
    return RiskField(rasters=[RasterRisk(values, (0, 0, 1, 1), nodata=0.5, **settings)])


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_a_raster_is_drawn_with_its_scale_and_what_it_lacks(interpolation: str) -> None:
    figure = map_figure(scenario(field=people(interpolation=interpolation)), [])
    assert_tidy(figure)
    (image,) = figure.axes[0].images
    assert image.get_clim() == (0.0, 4.0)
    assert figure.axes[1].get_ylabel() == "risk per unit length"
    assert "no data, taken for 0.5" in [text.get_text() for text in figure.legends[0].get_texts()]
    assert any(patch.get_hatch() == "...." for patch in figure.axes[0].patches)


def test_the_table_says_the_unit_of_a_raster_s_risk() -> None:
    problem = scenario(field=people(unit="people/m2")).problem
    straight = LabelledPath("straight", solve(problem, "straight-line"))
    assert maps.numbers_table(problem, [straight], 0.5)[-1] == ["risk in people/m2 x m"]
    assert len(maps.numbers_table(scenario().problem, [straight], 0.5)) == 4


def test_cells_without_data_are_hatched_where_they_are() -> None:
    figure = map_figure(scenario(field=people(origin="lower")), [])
    (gone,) = [patch for patch in figure.axes[0].patches if patch.get_hatch() == "...."]
    assert gone.get_path().get_extents().extents == pytest.approx([2.0 / 3.0, 0.0, 1.0, 0.5])


def test_one_hot_cell_does_not_drown_the_others() -> None:
    values = np.ones((900, 900))
    values[123, 456] = 1000.0
    field = RiskField(rasters=[RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")])
    figure = map_figure(scenario(field=field), [])
    assert_tidy(figure)
    (image,) = figure.axes[0].images
    assert image.get_array().max() == 1000.0
    assert image.norm(1.0) == pytest.approx(0.1)
    assert figure.axes[1].get_ylabel() == "risk per unit length,\ncolours by its cube root"
