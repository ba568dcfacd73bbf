"""The clock of a solver's run starts when its kernels are compiled."""

import subprocess
import sys
from pathlib import Path

import pytest
from kept_kernels import kept_but_for

from cgla_graph.solvers import registry, warm_up

# Compiling is an event of numba's. Nothing is compiled while a run or a proof is timed, though kernels are missing on
# disk.
WATCHED = """
import sys, time
import numba.core.event as events

compiled = []

class Listener(events.Listener):
    def on_start(self, event): compiled.append(time.perf_counter())
    def on_end(self, event): compiled.append(time.perf_counter())

events.register("numba:compile", Listener())
import cgla_graph as cg

problem = cg.load_scenario("one-threat").problem
for solve in (
    lambda: cg.lower_bound(problem, 0.05).seconds,
    lambda: cg.solve(problem, "hybrid", tolerance=None).seconds,
    lambda: cg.solve(problem, "cgla").build_seconds,
):
    compiled.clear()
    solve_began = time.perf_counter()
    seconds = solve()
    ended = time.perf_counter()
    total = ended - solve_began
    # what compiling took, without what was compiled for it
    compiling = compiled[-1] - compiled[0] if compiled else 0.0
    print(seconds, total - compiling + 1.0, compiling)
"""


@pytest.mark.slow
def test_no_time_holds_any_compiling(tmp_path: Path) -> None:
    missing = (
        "certificate_kernels.steepness",
        "refine_kernels.minimise",
        "refine_kernels.shortcut",
        "graph_kernels.complete",
    )
    environment = kept_but_for(*missing, at=tmp_path / "kernels")
    done = subprocess.run([sys.executable, "-c", WATCHED], env=environment, capture_output=True, text=True, check=True)
    times = [tuple(map(float, line.split())) for line in done.stdout.splitlines()]
    assert len(times) == 3
    # the first one compiles most
    assert times[0][2] > 1.0
    assert all(seconds < rest for seconds, rest, _ in times)


@pytest.mark.parametrize("name", registry.names())
def test_every_solver_is_run_once_and_briefly(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second time does nothing, and solvers that may crash are not run here."""
    monkeypatch.setattr(warm_up, "_ready", set())
    solver = registry.get(name)
    runs: list[object] = []
    own = type(solver).solve

    def watched(self: object, problem: object) -> object:
        runs.append(own(self, problem))
        return runs[-1]

    monkeypatch.setattr(type(solver), "solve", watched)
    for _ in range(2):
        warm_up.warm_up(solver)
    assert len(runs) == (0 if solver.traits.isolated else 1)


def test_limits_of_a_short_run_are_small_and_other_settings_stay() -> None:
    solver = registry.get("bit-star", iterations=10**8, evaluations=5, seed=3)
    short = warm_up.shortened(solver)
    assert (short.iterations, short.seconds, short.evaluations, short.seed) == (200, 0.5, 5, 3)
