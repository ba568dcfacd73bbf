"""The paper's figures, remade: tidy pages, captions that say what is drawn, and the same bytes every time."""

import dataclasses
import itertools
import math
import re
import sys
from functools import cache
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from figures import assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from scipy.integrate import quad
from strategies import examples, few, points, seeds

from cgla_graph.comparisons.claims.artefact import Artefact, Picture, artefacts
from cgla_graph.comparisons.claims.figures import lattice_figure, single_figures, team_figures
from cgla_graph.comparisons.claims.figures.figure_page import NARROW, SELECTED, WIDE, add_map, draw_route, finish, page
from cgla_graph.comparisons.claims.paper.field_claims import HIGH, LOW, SIGMAS, weights_from_origin
from cgla_graph.comparisons.claims.paper.flights import GOAL, START, STEP, paper_lattice
from cgla_graph.comparisons.claims.paper.routes import (
    Route,
    Routes,
    arrived,
    both,
    escape,
    fly,
    for_weights,
    paper_field,
    planned,
)
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.plots.scene import line_key
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.solvers import get

FIGURES = {one.label: one for one in artefacts() if one.label.startswith("Fig") and not one.experiments}
#: Figures on the map that was selected to agree with the paper.
ON_SELECTED = {"Fig. 5", "Fig. 7", "Fig. 8", "Fig. 11"}
#: Dots that a picture may be wide, so that its words are read where it is shown 900 dots wide.
MOST_DOTS = 1620


@cache
def once(name: str, *, solver: str | None = None) -> list[MissionRun]:
    """Fly a mission for all tests."""
    return fly(name, solver=solver)


def drawn(artefact: Artefact, monkeypatch: pytest.MonkeyPatch) -> tuple[Figure, Picture]:
    """Make an artefact, and get hold of its figure; no files are made of it, which takes long."""
    figures: list[Figure] = []

    def kept(figure: Figure, caption: str) -> Picture:
        figures.append(figure)
        return Picture(caption, b"", b"")

    monkeypatch.setattr(sys.modules[artefact.make.__module__], "picture", kept)
    monkeypatch.setattr(team_figures, "fly", once)
    monkeypatch.setattr(lattice_figure, "SIZES", (10, 15, 20, 25))
    made = artefact.make()
    assert isinstance(made, Picture)
    (figure,) = figures
    return figure, made


@pytest.mark.slow
@pytest.mark.parametrize("label", FIGURES)
def test_a_figure_is_tidy_and_its_caption_honest(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    artefact = FIGURES[label]
    figure, made = drawn(artefact, monkeypatch)
    assert_tidy(figure)
    assert figure.texts[0].get_text() == artefact.label
    assert figure.get_size_inches()[0] * 150 < MOST_DOTS
    # what is the paper's and what is ours is said, and whether the map was selected
    assert "ours" in made.caption or "our default" in made.caption
    assert (SELECTED in made.caption) == (artefact.label in ON_SELECTED)
    assert "nan" not in re.findall(r"[a-z]+", made.caption)


@pytest.mark.parametrize("label", ["Fig. 2", "Fig. 10"])
def test_a_figure_has_the_same_bytes_every_time(label: str) -> None:
    made = FIGURES[label].make()
    assert made == FIGURES[label].make()
    assert isinstance(made, Picture)
    assert made.png.startswith(b"\x89PNG")
    assert ET.fromstring(made.svg).tag.endswith("svg")  # noqa: S314 - our own
    assert b"<dc:date>" not in made.svg


# --- pages ---


def some_page(sides: list[list[float]], words: list[str], columns: int) -> Figure:
    with page() as figure:
        rows = [[(figure.add_subplot(), (side, side)) for side in row] for row in sides]
        for axes in itertools.chain(*rows):
            axes[0].set(xlabel="x", ylabel="y", title="a title")
        bar = add_map(figure, RiskField([Threat(0.5, 0.5, 0.1)]), "with a bar", bar=True)
        rows[0].append((bar, (NARROW, NARROW)))
        keys = [(line_key(color="k"), text) for text in words]
        return finish(figure, ("Fig. 0", "what it shows " * 9), rows, keys, columns=columns)


# letters, as the font lacks others
texts = st.text("abcdefghijklmnopqrstuvwxyz ", min_size=1, max_size=40)
grids = st.lists(st.lists(st.sampled_from([NARROW, WIDE]), min_size=1, max_size=2), min_size=1, max_size=2)


@pytest.mark.slow
@examples(6)
@given(sides=grids, words=st.lists(texts, max_size=4), columns=st.integers(1, 2))
def test_parts_of_a_page_never_overlap(sides: list[list[float]], words: list[str], columns: int) -> None:
    figure = some_page(sides, words, columns)
    assert_tidy(figure)
    shown = [axes.get_position() for axes in figure.axes if axes.get_xlabel()]
    width, height = figure.get_size_inches()
    found = [(round(place.width * width, 6), round(place.height * height, 6)) for place in shown]
    assert found == [(side, side) for row in sides for side in row] + [(NARROW, NARROW)]


def test_parts_of_a_page_overlap_without_gaps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cgla_graph.plots.page._GAP", -1.0)
    with pytest.raises(AssertionError):
        assert_tidy(some_page([[WIDE, WIDE]], ["a"], 1))


@few
@given(path=st.lists(points, min_size=2, max_size=5), number=st.integers(0, 2), dashed=st.booleans())
def test_a_way_is_drawn_where_it_leads(path: list[tuple[float, float]], number: int, dashed: bool) -> None:
    with page() as figure:
        axes = add_map(figure, RiskField(), "")
        draw_route(axes, np.array(path), number, 3, dashed=dashed)
    halo, line = axes.lines
    assert line.get_xydata().tolist() == halo.get_xydata().tolist() == np.array(path).tolist()
    assert line.get_zorder() > halo.get_zorder()


def test_the_same_risk_has_the_same_colour_on_every_map() -> None:
    with page() as figure:
        maps = [add_map(figure, RiskField([Threat(0.5, 0.5, 0.1, peak=peak)]), "") for peak in (0.1, 1.0)]
    assert {axes.images[0].get_clim() for axes in maps} == {(0.0, 1.0)}


# --- Figs 2 and 3 ---


def test_the_lengths_of_fig_2_are_those_of_geometry() -> None:
    made = FIGURES["Fig. 2"].make()
    straight, octile = math.hypot(5.0, 2.0), 3.0 + 2.0 * math.sqrt(2.0)
    for value in (f"{straight:.4f}", f"{octile:.4f}", f"{octile / straight - 1.0:.2%}"):
        assert value in made.caption


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("reading", single_figures.READINGS)
def test_weights_from_the_origin_are_length_and_integral(reading: str, sigma: float) -> None:
    low, high = weights_from_origin(reading, sigma)
    threat, at = Threat.from_eq1(0.5, 0.5, sigma, reading=reading), paper_lattice().points

    def density(share: float, x: float, y: float) -> float:
        square = (share * x - 0.5) ** 2 + (share * y - 0.5) ** 2
        return threat.peak * math.exp(-square / (2.0 * threat.spread**2))

    for node in (0, 57, 210, 399):
        x, y = at[node].tolist()
        length = math.hypot(x, y)
        integral = length * quad(density, 0.0, 1.0, args=(x, y), points=[0.5], epsabs=1e-13, limit=200)[0]
        assert low[node] == pytest.approx(length + LOW * integral, rel=1e-9)
        assert high[node] == pytest.approx(length + HIGH * integral, rel=1e-9)
    assert ((high >= low) & (high <= HIGH / LOW * low * (1.0 + 1e-12))).all()


# --- ways ---


@few
@given(seed=seeds, k=st.floats(0.0, 200.0))
def test_a_planned_way_is_no_shorter_than_the_straight_line_and_its_risk_that_of_its_steps(seed: int, k: float) -> None:
    rng = np.random.default_rng(seed)
    field = RiskField([Threat(x, y, 0.05) for x, y in rng.uniform(0.2, 0.8, (3, 2)).tolist()])
    way = planned(field, k=k, n=8)
    assert (way.path[0].tolist(), way.path[-1].tolist()) == (list(START), list(GOAL))
    assert way.length >= math.dist(START, GOAL) - 1e-12
    # shapely walks along the path, a step at a time
    line = shapely.LineString(way.path)
    places = [line.interpolate(number * STEP) for number in range(math.ceil(line.length / STEP - 1e-9))]
    met = field.density([(place.x, place.y) for place in places] + [GOAL])
    assert way.risk_sum == pytest.approx(met.sum(), rel=1e-6, abs=1e-9)


def test_no_way_and_a_flight_that_does_not_arrive_are_refused() -> None:
    (view,) = once("fig12-five")
    flight = view.flight.uavs["a"]
    assert arrived(flight).length == pytest.approx(flight.length)
    with pytest.raises(AssertionError, match="did not arrive"):
        arrived(dataclasses.replace(flight, status=MissionStatus.OUT_OF_TICKS))


def test_ways_of_fig_5_and_6_are_those_of_the_shipped_missions() -> None:
    for mission, found in (("fig5", for_weights([10.0, 50.0, 200.0])), ("fig6", escape().routes)):
        missions = load_mission(mission).missions(get)
        assert [way.label for way in found] == list(missions)
        for way, one in zip(found, missions.values(), strict=True):
            flight = one.fly().uavs["a"]
            assert (way.online.length, way.online.risk_sum) == pytest.approx((flight.length, flight.risk_sum))


def test_ways_offline_follow_the_exchange_argument() -> None:
    found = [planned(paper_field(), k=k) for k in (0.0, 10.0, 50.0, 200.0)]
    lengths, costs = [way.length for way in found], [cost(way, 50.0) for way in found]
    assert lengths == sorted(lengths)
    assert lengths[0] == pytest.approx(math.dist(START, GOAL))
    assert costs[2] == min(costs)
    assert cost(both("", paper_field(), k=50.0).online, 50.0) > costs[2]


def cost(way: Route, k: float) -> float:
    return way.length + k * float(paper_field().line_integral(way.path[:-1], way.path[1:]).sum())


def test_the_escape_knows_the_sudden_threat_once() -> None:
    found = escape()
    centres = [(threat.x, threat.y) for threat in found.field.threats]
    assert centres.count((0.6, 0.5)) == 1
    assert len(centres) == len(set(centres)) == 8


# --- captions that would no longer be true ---


def swapped(name: str, *, solver: str | None = None) -> list[MissionRun]:
    """Fly, and mix up the variants, as a change of the program might."""
    views = once(name, solver=solver)
    return [
        dataclasses.replace(other, variant=view.variant)
        for view, other in zip(views, views[1:] + views[:1], strict=True)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("label", ["Fig. 4", "Fig. 7", "Fig. 9"])
def test_a_team_figure_that_shows_something_else_is_refused(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(team_figures, "fly", swapped)
    with pytest.raises(AssertionError, match=r"Fig\. "):
        FIGURES[label].make()


def test_a_figure_of_a_flight_that_does_not_arrive_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(name: str) -> list[MissionRun]:
        (view,) = once(name)
        flights = {uav.name: dataclasses.replace(uav, status=MissionStatus.STUCK) for uav in view.flight.uavs.values()}
        return [dataclasses.replace(view, flight=dataclasses.replace(view.flight, uavs=flights))]

    monkeypatch.setattr(team_figures, "fly", lost)
    with pytest.raises(AssertionError, match="does not arrive"):
        FIGURES["Fig. 10"].make()


def test_an_escape_that_is_not_safer_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = escape()
    low, high = found.routes
    turned = dataclasses.replace(
        found, routes=[Routes("K = 10", None, high.online), Routes("K = 100", None, low.online)]
    )
    monkeypatch.setattr(single_figures, "escape", lambda: turned)
    with pytest.raises(AssertionError, match=r"Fig\. 6"):
        FIGURES["Fig. 6"].make()


def test_a_lattice_of_more_points_never_costs_more_and_no_path_less_than_the_bound() -> None:
    lattices, plane, weighed = lattice_figure.excess(lattice_figure.maps()["random map 1"], (10, 20))
    assert weighed == [50 * 99, 200 * 399]
    assert (np.diff(lattices) <= 0.0).all()
    assert 0.0 <= plane <= lattices[-1]
    assert plane < lattice_figure.BOUND_WITHIN * 5.0
