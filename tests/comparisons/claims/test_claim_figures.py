"""The paper's figures and tables, remade: tidy pages, true captions, and the same bytes every time."""

import dataclasses
import math
import re
import sys
from functools import cache
from itertools import product
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from figures import assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from scipy.integrate import quad
from strategies import few

from cgla_graph.comparisons.claims.artefact import Artefact, Content, artefacts
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.figures import panel_figure, single_figures, team_figures
from cgla_graph.comparisons.claims.figures.figure_page import SELECTED
from cgla_graph.comparisons.claims.panel.flights import STEP, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import FACTORS, START, cells
from cgla_graph.comparisons.claims.paper.model_claims import HIGH, LOW, weights_from_origin
from cgla_graph.comparisons.claims.paper.printed_values import TABLES
from cgla_graph.comparisons.claims.paper.routes import GOAL, arrived, escape, for_weights, planned, runs_of
from cgla_graph.comparisons.claims.rule import VARIED, judged
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.solvers import get
from cgla_graph.testing.strategies import seeds

FIGURES = {one.label: one for one in artefacts() if one.label.startswith("Fig") and not one.experiments}
#: Figures on the map that was selected to agree with the paper.
ON_SELECTED = {"Fig. 5", "Fig. 7", "Fig. 8", "Fig. 11"}
#: Dots that a picture may be wide, so that its words are read where it is shown 900 dots wide.
MOST_DOTS = 1620


@cache
def once(name: str, *, solver: str | None = None) -> list[MissionRun]:
    """Fly a mission for all tests."""
    return runs_of(name, solver=solver)


def drawn(artefact: Artefact, monkeypatch: pytest.MonkeyPatch, *given: Evidence) -> tuple[Figure, Content]:
    """Make an artefact, and get hold of its figure; no files are made of it, which takes long."""
    figures: list[Figure] = []

    def kept(figure: Figure, caption: str) -> Content:
        figures.append(figure)
        return Content(caption)

    monkeypatch.setattr(sys.modules[artefact.make.__module__], "picture", kept)
    monkeypatch.setattr(team_figures, "runs_of", once)
    made = artefact.make(*given)
    (figure,) = figures
    return figure, made


@pytest.mark.slow
@pytest.mark.parametrize("label", FIGURES)
def test_a_figure_is_tidy_and_its_caption_says_what_is_ours(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    artefact = FIGURES[label]
    figure, made = drawn(artefact, monkeypatch)
    assert_tidy(figure)
    assert figure.texts[0].get_text() == artefact.label
    assert figure.get_size_inches()[0] * 150 < MOST_DOTS
    assert "ours" in made.caption or "our default" in made.caption
    assert (SELECTED in made.caption) == (artefact.label in ON_SELECTED)
    assert "nan" not in re.findall(r"[a-z]+", made.caption)


def test_a_figure_has_the_same_bytes_every_time_and_true_lengths() -> None:
    made = FIGURES["Fig. 2"].make()
    assert made == FIGURES["Fig. 2"].make()
    straight, octile = math.hypot(5.0, 2.0), 3.0 + 2.0 * math.sqrt(2.0)
    assert all(value in made.caption for value in (f"{straight:.4f}", f"{octile:.4f}", f"{octile / straight - 1:.2%}"))
    assert made.png.startswith(b"\x89PNG")
    assert ET.fromstring(made.svg).tag.endswith("svg")  # noqa: S314 - our own
    assert b"<dc:date>" not in made.svg


@pytest.mark.parametrize("reading", single_figures.READINGS)
def test_weights_of_fig_3_are_length_and_integral(reading: str) -> None:
    low, high = weights_from_origin(reading, single_figures.SHOWN_SIGMA)
    threat = Threat.from_eq1(0.5, 0.5, single_figures.SHOWN_SIGMA, reading=reading)

    def density(share: float, x: float, y: float) -> float:
        square = (share * x - 0.5) ** 2 + (share * y - 0.5) ** 2
        return threat.peak * math.exp(-square / (2.0 * threat.spread**2))

    for node in (0, 57, 210, 399):
        x, y = paper_lattice().points[node].tolist()
        length = math.hypot(x, y)
        integral = length * quad(density, 0.0, 1.0, args=(x, y), points=[0.5], epsabs=1e-13, limit=200)[0]
        assert (low[node], high[node]) == pytest.approx((length + LOW * integral, length + HIGH * integral), rel=1e-9)


@few
@given(seed=seeds, k=st.floats(0.0, 200.0))
def test_a_planned_way_has_the_risk_of_its_steps(seed: int, k: float) -> None:
    rng = np.random.default_rng(seed)
    field = RiskField([Threat(x, y, 0.05) for x, y in rng.uniform(0.2, 0.8, (3, 2)).tolist()])
    way = planned(field, k=k, n=8)
    assert way.length >= math.dist(START, GOAL) - 1e-12
    # shapely walks along the path, a step at a time
    line = shapely.LineString(way.path)
    places = [line.interpolate(number * STEP) for number in range(math.ceil(line.length / STEP - 1e-9))]
    met = field.density([(place.x, place.y) for place in places] + [GOAL])
    assert way.risk_sum == pytest.approx(met.sum(), rel=1e-6, abs=1e-9)


def test_ways_of_fig_5_and_6_are_those_of_the_shipped_missions_and_arrive() -> None:
    for mission, found in (("fig5", for_weights()), ("fig6", escape().routes)):
        for way, one in zip(found, load_mission(mission).missions(get).values(), strict=True):
            flight = one.fly().uavs["a"]
            assert (way.online.length, way.online.risk_sum) == pytest.approx((flight.length, flight.risk_sum))
            with pytest.raises(AssertionError, match="did not arrive"):
                arrived(dataclasses.replace(flight, status=MissionStatus.OUT_OF_TICKS))


def swapped(name: str, *, solver: str | None = None) -> list[MissionRun]:
    """Fly, and mix up the variants, as a change of the program might."""
    views = once(name, solver=solver)
    return [dataclasses.replace(b, variant=a.variant) for a, b in zip(views, views[1:] + views[:1], strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("label", ["Fig. 4", "Fig. 7", "Fig. 9"])
def test_a_team_figure_that_shows_something_else_is_refused(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(team_figures, "runs_of", swapped)
    with pytest.raises(AssertionError, match=r"Fig\. "):
        FIGURES[label].make()


@pytest.mark.slow
def test_tables_have_every_printed_number_and_none_of_ours_beside_a_quoted_one() -> None:
    found = {one.label: one.make() for one in artefacts() if one.label.startswith("Table")}
    assert len(found) == 5
    for row, (name, quantity) in product(TABLES, (("risk", "risk sum"), ("length", "length"))):
        printed, made = getattr(row, name), found[row.place]
        assert made.table
        rows = [one for one in made.table.rows if one[:2] == (row.method, quantity)]
        assert len(rows) == (not math.isnan(printed))
        if rows:
            assert float(str(rows[0][2])) == printed
            assert (rows[0][3] is None) == (rows[0][4] is None) == (not row.own_risk)


def test_the_panel_figure_draws_every_level(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, records = np.random.default_rng(1), []
    for number, cell in product(range(8), cells()):
        for planner in ("cgla", "eight-direction", "bcv-style, risk_aversion 0"):
            sizes = {name: float(rng.uniform(1.0, 1.1)) for name in ("length", "cost", "risk")}
            records.append({"map": number, **cell, "mode": "flown", "planner": planner, VARIED: "", **sizes})
    (figure,) = (one for one in artefacts() if one.label == "Fig. A1")
    samples = Samples(records)
    drawing, _ = drawn(figure, monkeypatch, Evidence(samples={"single-uav": samples}))
    assert_tidy(drawing)
    first, second = (axes for axes in drawing.axes if axes.get_xlabel())
    assert len(first.get_yticks()) == sum(len(levels) for levels in FACTORS.values())
    assert len(second.get_yticks()) == len(first.get_yticks()) - len(FACTORS["k"])
    one = judged(samples, panel_figure.PANELS["eight directions over CGLA, flown"][0])
    ratio, low, high = panel_figure.level_ratio(one, one.levels[0])
    assert low <= ratio <= high
