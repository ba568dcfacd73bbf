"""Pictures from Python: the output of `plot` and `animate`, which leave matplotlib's settings and figures alone."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import assume, given
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from strategies import examples

import cgla_graph as cg
from cgla_graph._text import figure as digits_of
from cgla_graph.plots.graph import drawn_edges
from cgla_graph.testing import strategies as drawn

PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)


def test_everything_draws_on_axes_that_are_given_and_touches_nothing_else() -> None:
    solution, proof = cg.solve(PROBLEM, "cgla", resolution=5), cg.lower_bound(PROBLEM, 0.2)
    flight = cg.Mission(cg.World(), [cg.Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2)], cg.solvers.get("cgla")).fly()
    settings, figures = dict(mpl.rcParams), plt.get_fignums()
    graph = PROBLEM.on_lattice(3)
    matrix = cg.cost_matrix(graph.graph, target=graph.target)
    checked = cg.check([(0.1, 0.1), (0.5, 0.9), (0.9, 0.9)], PROBLEM)
    maps = (PROBLEM, solution, proof, flight, flight.mission, checked)
    for thing in (*maps, graph, graph.graph, matrix, cg.solve(graph, "cgla")):
        axes = Figure().add_subplot()
        assert cg.plot(thing, axes) is axes
        assert axes.has_data()
    assert (dict(mpl.rcParams), plt.get_fignums()) == (settings, figures)


def test_a_cost_matrix_is_drawn_with_its_values_and_its_ways() -> None:
    graph = cg.GeometricGraph.complete(cg.Lattice(4, bounds=(0, 0, 1, 1)), PROBLEM.field, k=10.0)
    matrix = cg.cost_matrix(graph, target=15)
    axes = matrix.plot(ax=Figure().add_subplot())
    ways, dots = axes.collections[1:]
    assert len(ways.get_segments()) == 15
    np.testing.assert_array_equal(dots.get_array(), matrix.values)


def test_a_mission_is_drawn_before_it_is_flown() -> None:
    mission = cg.Mission(cg.World(), [cg.Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2)], cg.solvers.get("cgla"))
    axes = mission.plot()
    try:
        (legend,) = axes.figure.legends
        assert [text.get_text() for text in legend.get_texts()] == ["a", "start", "goal"]
        assert [text.get_text() for text in axes.figure.texts] == ["mission"]
    finally:
        plt.close(axes.figure)


@pytest.mark.parametrize("draw", [cg.plot, cg.animate])
def test_what_has_no_picture_says_so(draw: Callable[[object], object]) -> None:
    with pytest.raises(cg.CglaError, match="str"):
        draw("a map")


def test_solutions_are_named_by_solver_and_cost() -> None:
    solution = cg.solve(PROBLEM, "cgla", resolution=5)
    axes = PROBLEM.plot(solution, ax=Figure().add_subplot())
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words[0] == f"cgla: {solution.cost:.5g}"


@given(drawn.problems(max_threats=2))
@examples(5)
def test_pictures_of_a_proof_have_the_path_that_it_knows(problem: cg.Problem) -> None:
    proof = cg.lower_bound(problem, 0.2, max_cells=20_000)
    assume(proof.path is not None and problem.start != problem.goal)
    with_path, without = (one.plot(ax=Figure().add_subplot()) for one in (proof, replace(proof, path=None)))
    drawn = [line for line in with_path.lines if line.get_label() == "path" or len(line.get_xydata()) > 1]
    assert len(with_path.lines) == len(without.lines) + 1
    assert [np.array_equal(line.get_xydata(), proof.path) for line in drawn] == [True]
    words = [text.get_text() for text in with_path.get_legend().get_texts()]
    assert words[0] == f"path: {digits_of(proof.upper_bound, 5)}"


def test_a_copy_from_elsewhere_says_how_it_is_drawn() -> None:
    copy = pickle.loads(pickle.dumps(cg.solve(PROBLEM, "straight-line")))  # noqa: S301 - our own bytes
    with pytest.raises(cg.CglaError, match=r"problem\.plot\(solution\)"):
        copy.plot()
    assert PROBLEM.plot(copy, ax=Figure().add_subplot()).has_data()


@pytest.mark.slow
def test_the_film_is_written_as_the_command_writes_it(tmp_path: Path) -> None:
    mission = cg.Mission(cg.World(), [cg.Uav("a", (0.1, 0.1), (0.3, 0.3), 0.2)], cg.solvers.get("cgla"))
    film = mission.fly().animate(ax=Figure().add_subplot())
    film.save(tmp_path / "film.gif")
    assert (tmp_path / "film.gif").read_bytes().startswith(b"GIF89a")
    assert "data:image/gif;base64," in film._repr_html_()


def test_a_legend_never_covers_more_than_a_fifth_of_axes() -> None:
    solutions = [cg.solve(PROBLEM, name, resolution=5) for name in ("cgla", "dijkstra")]
    solutions += [cg.solve(PROBLEM, "straight-line")]
    found = {}
    for side in (0.4, 1.5, 2.2, 6.0):
        figure = Figure(figsize=(side / 0.8, side / 0.8))
        axes = PROBLEM.plot(*solutions, ax=figure.add_axes((0.1, 0.1, 0.8, 0.8)))
        figure.canvas.draw()
        legend = axes.get_legend()
        found[side] = [] if legend is None else [text.get_text() for text in legend.get_texts()]
        if legend is not None:
            box, room = legend.get_window_extent(), axes.get_window_extent()
            assert box.width * box.height <= 0.21 * room.width * room.height
    assert found[0.4] == []
    assert {word.split(":")[0] for word in found[6.0]} == {"cgla", "dijkstra", "straight-line", "start", "goal"}
    assert found[2.2] in (found[6.0], found[6.0][:3])


def test_without_axes_a_figure_of_pyplot_is_made_and_headed_by_the_weight() -> None:
    axes = cg.solve(PROBLEM, "straight-line").plot()
    try:
        assert axes.figure.number in plt.get_fignums()
        assert "k = 10" in [text.get_text() for text in axes.figure.texts]
    finally:
        plt.close(axes.figure)


def test_edges_are_drawn_where_they_are_few() -> None:
    """Also of graphs whose weights were given, of which no pair is weighed."""
    for n, count in ((30, 870), (70, 0)):
        weights = np.ones((n, n))
        graph = cg.GeometricGraph.from_sparse(
            cg.GeometricGraph.from_matrix(weights).to_csgraph(), positions=np.random.default_rng(1).random((n, 2))
        )
        assert len(drawn_edges(graph)) == count
