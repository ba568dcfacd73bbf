"""Speed of the paper's peers, as ratios measured in one run: ``make bench``; see `test_speed`."""

import statistics

import numpy as np
import plain_q_learning as plain
from pytest_benchmark.fixture import BenchmarkFixture
from test_speed import report, seconds

import cgla_graph as cg
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers.grid import q_learning_kernels as kernels
from cgla_graph.solvers.grid.q_learning import QLearning
from cgla_graph.solvers.grid.value_iteration import decision_process

#: CGLA's 7.636752 s and Q-Learning's 26.4662 s, in the paper's section 5.1.
RATIO_OF_THE_PAPER = 26.4662 / 7.636752


def test_q_learning_against_plain_python(benchmark: BenchmarkFixture) -> None:
    """The same episodes on the paper's map, to the last bit."""
    scenario = load_scenario("paper")
    process = decision_process(scenario.problem.on_eight_connected(scenario.lattice))
    earned = process.earned.tolist()
    moves = [
        [(m, int(process.heads[m]), earned[m]) for m in range(process.first[s], process.first[s + 1])]
        for s in range(process.n_states)
    ]
    starts = [s for s in range(process.n_states) if s != process.target]
    first_value = QLearning()._first_value(process)

    def ours() -> np.ndarray:
        values = np.full(process.n_moves, first_value)
        kernels.train(
            process.first,
            process.heads,
            process.earned,
            process.target,
            np.array(starts),
            alpha=1.0,
            gamma=1.0,
            epsilon=1.0,
            last_epsilon=0.01,
            episodes=500,
            max_steps=80,
            tolerance=0.0,
            quiet=50,
            seed=1,
            values=values,
            visits=np.zeros(process.n_moves, dtype=np.int64),
        )
        return values

    def reference() -> list[float]:
        values = [first_value] * process.n_moves
        plain.train(
            moves,
            process.target,
            starts,
            values,
            alpha=1.0,
            gamma=1.0,
            epsilon=(1.0, 0.01),
            episodes=500,
            max_steps=80,
            tolerance=0.0,
            quiet=50,
            seed=1,
        )
        return values

    np.testing.assert_array_equal(ours(), reference())
    ratio = report(benchmark, "Q-Learning, 500 episodes on 20 x 20, against plain Python", ours, reference, rounds=5)
    assert ratio >= 30


def test_q_learning_against_cgla(benchmark: BenchmarkFixture) -> None:
    """One plan of the paper's map by each, weighing included; the paper's ratio is no target, its code is unknown."""
    scenario = load_scenario("paper")

    def plan(name: str) -> float:
        return seconds(lambda: cg.solve(scenario.problem, name, resolution=scenario.lattice), 1)

    for name in ("cgla", "q-learning"):
        plan(name)
    times = {name: statistics.median(plan(name) for _ in range(7)) for name in ("cgla", "q-learning")}
    ratio = times["q-learning"] / times["cgla"]
    benchmark.extra_info["Q-Learning / CGLA"] = round(ratio, 3)
    benchmark.pedantic(lambda: plan("q-learning"), rounds=7)
    print(
        f"\none plan: cgla {times['cgla'] * 1e3:.1f} ms, q-learning {times['q-learning'] * 1e3:.1f} ms: "
        f"ratio {ratio:.2f} (the paper's: {RATIO_OF_THE_PAPER:.2f})"
    )
