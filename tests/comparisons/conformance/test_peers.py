"""Planners of other libraries: they read problems as the oracle does, and what they write is judged, not believed."""

import json
import math
import runpy
import shutil
import subprocess
import sys
from importlib import util
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from cgla_graph.comparisons.conformance.suite import Instance, chosen, suite

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples" / "conformance"
GRIDS = runpy.run_path(str(EXAMPLES / "grids.py"))
PEERS = runpy.run_path(str(ROOT / "tests" / "benchmarks" / "peers.py"))
#: Reads a problem, then segments, a line each; prints the cost of each, and whether it crosses an area.
SEGMENTS = """
#include "problem.hpp"
int main() {
    std::string line;
    std::getline(std::cin, line);
    const Map map(Reader{line.c_str()}.value());
    for (Point a, b; std::cin >> a.x >> a.y >> b.x >> b.y;)
        std::printf("%.17g %d\\n", map.cost(a, b), map.crosses(a, b));
}
"""
#: Answers with a history of its own: no path, one that is twice as long, one through whatever is there.
STAND_IN = """
import json, sys
problem = json.load(sys.stdin)
start, goal = problem["start"], problem["goal"]
around = [start, [start[0], 0.99], [goal[0], 0.99], goal]
history = [{"seconds": 0.1, "path": None}, {"seconds": 0.2, "path": around}, {"seconds": 0.4, "path": [start, goal]}]
if sys.argv[1] == "crash":
    sys.exit("no memory for that")
json.dump({"path": [start, goal], "history": history}, sys.stdout)
"""


def segments(one: Instance, count: int) -> np.ndarray[Any, Any]:
    low, high = np.reshape(one.problem.bounds, (2, 2))
    draw = np.random.default_rng(3)
    ends = low + (high - low) * draw.random((count, 2, 2))
    ends[::2, 1] = np.clip(ends[::2, 0] + 0.05 * (high - low) * draw.normal(size=(len(ends[::2]), 2)), low, high)
    return ends


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no compiler")
@pytest.mark.slow
def test_costs_in_cpp_are_those_of_the_oracle(tmp_path: Path) -> None:
    (tmp_path / "segments.cpp").write_text(SEGMENTS, encoding="utf-8")
    words = ["g++", "-O1", "-std=c++17", "-I", EXAMPLES, "-o", tmp_path / "segments", tmp_path / "segments.cpp"]
    subprocess.run(words, check=True, timeout=120)
    for one in suite():
        problem, ends = one.problem.build(), segments(one, 60)
        lines = [one.problem.model_dump_json(), *(" ".join(map(repr, four)) for four in ends.reshape(-1, 4).tolist())]
        done = subprocess.run(
            [tmp_path / "segments"], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=60
        )
        told = np.array([line.split() for line in done.stdout.splitlines()], dtype=np.float64)
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        expected = length + problem.k * problem.field.line_integral(ends[:, 0], ends[:, 1])
        assert told[:, 0] == pytest.approx(expected, rel=1e-8), one.name
        assert told[:, 1].astype(bool).tolist() == problem.model.area.crosses(ends[:, 0], ends[:, 1]).tolist(), one.name


@pytest.mark.skipif(
    shutil.which("pkg-config") is None
    or subprocess.run(["pkg-config", "--exists", "ompl"], check=False, timeout=20).returncode != 0,  # noqa: S607 - wherever it is
    reason="OMPL for C++ is not installed",
)
@pytest.mark.slow
def test_planners_of_ompl_answer(tmp_path: Path) -> None:
    subprocess.run(["sh", EXAMPLES / "build_ompl.sh", tmp_path], check=True, timeout=300)  # noqa: S607 - the shell
    # (LBTRRT aborts on the second if it is told of the goal twice)
    for one, (name, settings) in product(chosen(["walls-guarded", "open-valley"]), PEERS["OMPL"].items()):
        command = [str(tmp_path / "ompl"), name, *settings, "--history", "--seconds", "0.4"]
        row = PEERS["theirs"](name, command, one, 0.4)
        assert row.excess < 2.0, row
        assert row.fault == "", row


@pytest.mark.parametrize("one", [one for one in suite() if one.has_path], ids=lambda one: one.name)
def test_grids_have_the_risk_and_the_areas_of_the_oracle(one: Instance) -> None:
    grid = GRIDS["Grid"](json.loads(one.problem.model_dump_json()), 23)
    problem = one.problem.build()
    points = np.stack(np.meshgrid(grid.x, grid.y, indexing="ij"), axis=-1)
    assert tuple(points[grid.goal]) == pytest.approx(problem.goal)
    more = grid.risk(json.loads(one.problem.model_dump_json())) - problem.field.density(points)
    # (a node on the edge of two cells has the lesser value for the oracle)
    assert more.min() > -1e-9
    assert (more < 1e-9).mean() > 0.9
    closed = grid.closed(one.problem.model_dump()["no_fly"])
    area = problem.no_fly or shapely.Point()
    away = (
        shapely.distance(area, shapely.points(points)) if problem.no_fly is not None else np.full(closed.shape, np.inf)
    )
    # (a node whose distance is the clearance may be either)
    sure = abs(away - GRIDS["CLEARANCE"] * grid.step) > 1e-9
    assert (closed == (away < GRIDS["CLEARANCE"] * grid.step))[sure].all()


def test_a_way_down_a_grid_leads_to_the_goal() -> None:
    """The stand-in for a library knows the distance alone, which is right where there is no risk."""

    def distance(cost: Any, goal: tuple[int, int], step: float) -> Any:  # noqa: ANN401 - arrays
        i, j = np.ogrid[: cost.shape[0], : cost.shape[1]]
        return step * np.hypot(i - goal[0], j - goal[1])

    (one,) = chosen(["open-straight"])
    path = GRIDS["plan"](json.loads(one.problem.model_dump_json()), distance, 64)
    assert one.problem.build().evaluate(path).cost <= 1.001 * (one.upper_bound or 0.0)


@pytest.mark.parametrize(("name", "package"), PEERS["GRIDS"].items())
def test_libraries_that_march_find_a_way(name: str, package: str) -> None:
    if util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    for which, most in (("open-one", 1.005), ("walls-guarded", 1.1)):
        (one,) = chosen([which])
        path = GRIDS["plan"](json.loads(one.problem.model_dump_json()), GRIDS["LIBRARIES"][name], 96)
        found = one.problem.build().evaluate(path)
        assert found.feasible, name
        assert found.cost <= most * (one.lower_bound or 0.0), name


def test_maps_of_the_table_are_the_same_again_and_have_a_path() -> None:
    for kind in PEERS["KINDS"]:
        first, again, other = (PEERS["drawn"](kind, seed) for seed in (1, 1, 2))
        assert first == again != other
        assert 1.0 <= first.k <= 100.0
        assert bool(first.rasters) == (kind in {"smooth", "rough"})
        assert bool(first.no_fly) == (kind != "threats")
        first.build()


def test_what_a_planner_writes_is_judged(tmp_path: Path) -> None:
    script = tmp_path / "planner.py"
    script.write_text(STAND_IN, encoding="utf-8")
    (one,) = chosen(["open-straight"])
    row = PEERS["theirs"]("stand-in", [sys.executable, str(script), "answer"], one, 5.0)
    assert row.seconds == (0.4, 0.4, 0.4)
    assert abs(row.excess) < 1e-8
    # through a wall: the path around it is what counts
    (one,) = chosen(["walls-corner"])
    row = PEERS["theirs"]("stand-in", [sys.executable, str(script), "answer"], one, 5.0)
    assert row.seconds == (math.inf,) * 3
    assert 0.3 < row.excess < 2.0
    row = PEERS["theirs"]("stand-in", [sys.executable, str(script), "crash"], one, 5.0)
    assert (row.excess, row.fault) == (math.inf, "no memory for that")


def test_the_table_counts_failures_and_says_who_is_sooner() -> None:
    (one,) = chosen(["open-straight"])
    rows = [
        PEERS["row_of"]("hybrid", one, [(0.02, 0.9)]),
        PEERS["row_of"]("peer", one, [(0.01, 0.94), (0.5, 0.9)]),
        PEERS["row_of"]("none", one, [], "no path"),
    ]
    lines = PEERS["table"](rows).splitlines()[2:]
    assert lines[1] == "| `peer` | 1 of 1 | 10 ms (1) | 0.50 s (1) | 0.50 s (1) | 1, 0, 0 |"
    assert lines[2] == "| `none` | 0 of 1 | - (0) | - (0) | - (0) | 0, 0, 0 |"


def test_the_report_leaves_out_maps_that_were_not_finished_and_says_who_is_ahead() -> None:
    def row(planner: str, instance: str, seconds: float) -> dict[str, Any]:
        return {"planner": planner, "kind": "smooth", "instance": instance, "seconds": [seconds] * 3, "excess": 0.0}

    rows = [row("hybrid", "a", 0.2), row("pykonal", "a", 0.1), row("hybrid", "b", 0.1)]
    text = PEERS["report"]([{"seconds": 2.0, "maps": {"a": ["proven", 1.0], "b": ["known", 1.0]}, "rows": rows}])
    assert text.startswith("On 1 of the 40 maps; planners of OMPL had 2 s of CPU time on each.\n\n| planner")
    assert "| `hybrid` | 1 of 1 | 0.20 s (1) |" in text
    assert text.endswith("- `pykonal`: smooth to 5 % (1 of 1), smooth to 1 % (1 of 1), smooth to 0.1 % (1 of 1).")
