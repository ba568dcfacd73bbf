"""What a REPL shows of each public class fits on three lines, however large it is; what notebooks show is small."""

import base64
import dataclasses
import inspect
import io
import re
import subprocess
import sys
from functools import cache
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from PIL import Image

import cgla_graph as cg
from cgla_graph.model.solution import TracePoint
from cgla_graph.solvers.trade_off.front import Front, FrontPoint

RNG = np.random.default_rng(3)
SHOWN = (
    *("Problem", "GeometricGraph", "MissionFile", "Solution", "Flight", "Study"),
    *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in ("GraphProblem", "CostMatrix", "Scenario", "Certificate", "Mission")
    ),
)


@cache
def instances() -> dict[str, Any]:
    """Make a sizeable instance of each public class."""
    threats = [cg.Threat(float(x), float(y), 0.02, 0.4) for x, y in RNG.random((300, 2))]
    raster = cg.RasterRisk(RNG.random((60, 60)), (0, 0, 1, 1))
    field = cg.RiskField(threats, rasters=[raster])
    area = shapely.unary_union([shapely.Point(0.5, y).buffer(0.03, 64) for y in np.linspace(0.2, 0.8, 9)])
    problem = cg.Problem((0.05, 0.1), (0.95, 0.9), field, 10.0, no_fly=area, clearance=0.001)
    path = np.column_stack([np.linspace(0.05, 0.95, 5000), np.linspace(0.1, 0.9, 5000) + 0.01 * RNG.random(5000)])
    trace = tuple(TracePoint(0.1 * i, i, 2.0) for i in range(500))
    solution = cg.Solution(
        cg.Status.FOUND, path, tuple(range(5000)), 3.0, 2.0, 0.1, 0.01, 2.9, "hybrid", trace=trace, problem=problem
    )
    simple = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(threats[:20]), 5.0)
    lattice = cg.Lattice(40, bounds=(0, 0, 1, 1))
    graph = cg.GeometricGraph.complete(lattice, cg.RiskField(threats[:5]), 10.0)
    grid = cg.GeometricGraph.eight_connected(lattice, cg.RiskField(threats[:5]), 10.0)
    uavs = [cg.Uav(f"u{i}", (0.1, 0.1 * i), (0.9, 0.1 * i), detection_radius=0.2) for i in range(1, 4)]
    timed = [cg.TimedThreat(threat, appears=3) for threat in threats[:50]]
    closed = cg.TimedArea(area, appears=900)
    moving = [cg.MovingThreat([(i, x, y) for i, (x, y) in enumerate(RNG.random((200, 2)))], 0.1) for _ in range(50)]
    in_time = cg.TimedProblem((0.05, 0.1), (0.95, 0.9), field, moving, [closed] * 9, speed=0.1, no_fly=area)
    world = cg.World(cg.RiskField(threats[:3]), timed=[*timed, closed])
    mission = cg.Mission(world, uavs, cg.solvers.get("dijkstra"), resolution=8, max_ticks=3)
    comparisons = cg.comparisons
    scenario = dataclasses.replace(
        cg.load_scenario("paper"), name="<script>alert(1)</script>", notes="long " * 400, problem=problem
    )
    entrant = comparisons.Entrant.parse("rrt-star:iterations=500")
    made: list[Any] = [
        *(
            cg.FailureModel(1e-3, 20.0, 6.5),
            threats[0],
            raster,
            field,
            cg.UncertainField([field] * 50, [0.51, *[0.01] * 49]),
            problem,
            cg.Map(problem),
            solution,
            lattice,
            graph,
            uavs[0],
            timed[0],
            closed,
            moving[0],
            in_time,
            cg.Wind(RNG.random((5, 40, 40)), RNG.random((5, 40, 40)), (0, 0, 1, 1), range(5)),
            in_time.evaluate(in_time.fly(path)),
            flown := cg.solve(cg.TimedProblem((0.1, 0.1), (0.9, 0.9), speed=0.1), nodes=1000),
            flown.certificate,
            cg.TeamPlan(cg.Status.FOUND, (flown,) * 50, (flown,) * 50, order=tuple(range(50))),
            world,
            mission,
        ),
        cg.FailureModel(1e-3, 20.0, 6.5),
        *(cg.GraphProblem(grid, 0, 1599), cg.CostModel(field, 10.0, area), cg.NoFlyArea(area)),
        *(problem.evaluate(path), cg.cost_matrix(grid, target=0), cg.lower_bound(simple, 0.05), mission.fly()),
        cg.lower_bound(simple, 0.05).corridor(0.1, max_cells=20_000),
        *(cg.Map(simple).isochrones([0.2], steps=16), cg.Map(simple).solve(starts=[simple.start] * 50)),
        *(cg.Sharing(), cg.VirtualObstacle(), cg.Status.FOUND, cg.MissionStatus.ARRIVED, cg.CglaError("wrong")),
        *(scenario, entrant, comparisons.Run(scenario, "hybrid", None, exact=False, solution=solution)),
        comparisons.Study([scenario] * 30, [entrant] * 30),
        comparisons.graph_pairs(grid, pairs=1)[0],
        cg.Aircraft(12.0, power=300.0, battery=90.0),
        cg.load_mission("fig8"),
        comparisons.Metric("length", lambda path, problem: problem.evaluate(path).length, "m"),
        cg.Waypoint(24.0, 60.0),
        cg.FlightPlan(tuple(cg.Waypoint(24.0 + 1e-4 * i, 60.0) for i in range(900))),
        cg.VolumeSettings(speed=15.0, dimension=0.8, pitch=30.0, buffer="ballistic", width=25.0, gnss_error=2.0),
        Front(tuple(FrontPoint(i, i + 1, i, solution) for i in range(50)), cg.Status.OPTIMAL),
        FrontPoint(1.0, 2.0, 1.5, solution),
    ]
    return {type(one).__name__: one for one in made}


def public_classes() -> list[str]:
    """List the classes among the public names, of the package, its solvers and its comparisons."""
    found = {
        value.__name__
        for home in (cg, cg.comparisons, cg.solvers)
        for value in (getattr(home, name) for name in home.__all__)
        if inspect.isclass(value) and not getattr(value, "_is_protocol", False)
    }
    return sorted(found - {"Traits"})


def test_they_are_short() -> None:
    made = instances()
    assert {*public_classes(), "Front", "FrontPoint"} <= set(made), "give this test a sizeable instance of each"
    for one in (*made.values(), *map(cg.solvers.get, cg.solvers.names())):
        text = repr(one)
        assert len(text) <= 300, text[:600]
        assert text.count("\n") < 3, text[:600]


@pytest.mark.parametrize("name", SHOWN)
def test_notebooks_show_a_table_and_a_picture(name: str) -> None:
    text = instances()[name]._repr_html_()
    page = ET.fromstring(text)  # noqa: S314 - our own; and it fails on what is not closed or escaped
    assert page.find("table") is not None
    (picture,) = page.iter("img")
    kind, _, data = picture.attrib["src"].partition(";base64,")
    assert kind == "data:image/png"
    with Image.open(io.BytesIO(base64.b64decode(data))) as image:
        assert len(image.getcolors() or ()) > 10
    assert not re.search(r"<(script|style)|\bid=", text)
    assert len(text) < 60_000


def test_a_field_of_rasters_alone_is_shown() -> None:
    field = cg.RiskField(rasters=[cg.RasterRisk([[1.0]], (0, 0, 1, 1))])
    assert "field=RiskField(rasters=1 RasterRisk)" in repr(cg.Problem((0, 0), (1, 1), field))
    assert "field" not in repr(cg.Problem((0, 0), (1, 1)))


def test_names_are_escaped() -> None:
    found = cg.solve(cg.Problem((0, 0), (1, 1)), "straight-line")
    text = dataclasses.replace(found, solver="<script>alert('&')</script>")._repr_html_()
    assert "<script" not in text
    assert "&lt;script&gt;" in text


def test_graphs_without_places_have_a_table_alone() -> None:
    graph = cg.GeometricGraph.from_matrix(np.ones((5, 5)))
    text = cg.GraphProblem(graph, 0, 4)._repr_html_()
    assert "<table" in text
    assert "<img" not in text


def test_matplotlib_is_imported_where_something_is_drawn() -> None:
    code = (
        "import sys, cgla_graph as cg; p = cg.load_scenario('paper').problem; repr(cg.solve(p, 'straight-line')); "
        "early = 'matplotlib' in sys.modules; p._repr_html_(); sys.exit(early or 'matplotlib' not in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
