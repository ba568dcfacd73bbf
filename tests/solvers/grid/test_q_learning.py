"""Q-Learning learns the values of value iteration, which are exact."""

import dataclasses
import itertools
import math
import re
import warnings
from typing import Any

import networkx as nx
import numpy as np
import plain_q_learning as plain
import pytest
import shapely
import strategies as own
from hypothesis import assume, given
from hypothesis import strategies as st
from quick_solvers import WALLED_IN
from scipy.sparse import csgraph

import cgla_graph as cg
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers.grid import q_learning_kernels as kernels
from cgla_graph.solvers.grid.eight_direction import EightDirection
from cgla_graph.solvers.grid.q_learning import QLearning
from cgla_graph.solvers.grid.value_iteration import (
    REWARD_TOLERANCE,
    DecisionProcess,
    Reward,
    decision_process,
    greedy,
    least_target_reward,
    value_iteration,
)
from cgla_graph.testing import strategies as drawn

ONE = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)]), k=10.0)
#: Behind this threat, a circle in the open is worth more than the goal.
GUARDED = cg.Problem((0.0, 0.0), (1.0, 1.0), cg.RiskField([cg.Threat(1.0, 1.0, spread=0.2)]), k=10.0)


problems = own.lattice_problems().filter(lambda problem: problem.start != problem.goal)
resolutions = st.integers(2, 9) | st.tuples(st.integers(2, 7), st.integers(2, 7))
corner_rules: st.SearchStrategy[CornerRule] = st.sampled_from(["touch", "both-free"])
rewards: st.SearchStrategy[Reward] = st.sampled_from(["risk_aware", "node", "goal_only"])
discounts = st.floats(0.0, 0.98) | st.sampled_from([0.0, 0.5, 0.95])


@st.composite
def processes(draw: st.DrawFn) -> DecisionProcess:
    on = draw(problems).on_eight_connected(draw(resolutions), corner_rule=draw(corner_rules))
    reward = draw(rewards)
    least = 0.1 if reward == "goal_only" else 0.0
    return decision_process(on, reward=reward, target_reward=draw(st.floats(least, 30.0) | st.just(least)))


def within_reach(process: DecisionProcess) -> list[int]:
    """List the states that have moves and are not the target."""
    return [int(s) for s in np.flatnonzero(np.diff(process.first)) if s != process.target]


def tails(process: DecisionProcess) -> IntArray:
    """Return where each move begins, shape ``(m,)``."""
    return np.repeat(np.arange(process.n_states), np.diff(process.first))


# Value iteration


@own.few
@given(problems, resolutions, corner_rules)
def test_without_discount_values_are_the_costs_of_dijkstra(
    problem: cg.Problem, resolution: int | tuple[int, int], rule: CornerRule
) -> None:
    process = decision_process(problem.on_eight_connected(resolution, corner_rule=rule))
    values = value_iteration(process)
    search: Any = csgraph.dijkstra
    costs = search(process.on.graph.to_csgraph(), indices=process.target)
    np.testing.assert_allclose(-values.states, costs, rtol=1e-12)
    best = cg.solve(problem, EightDirection(resolution, rule))
    rollout = greedy(process, values.moves)
    assert rollout.circle == 0
    assert (rollout.states[-1] == process.target) == best.status.has_path
    if best.status.has_path:
        path = np.asarray(process.on.graph.positions)[list(rollout.states)]
        assert problem.evaluate(path).cost == pytest.approx(best.cost, rel=1e-12)


def by_horizon(process: DecisionProcess, gamma: float) -> FloatArray:
    """Return V* by a dense recursion over so many moves that the rest does not count, from above."""
    n = process.n_states
    earned = np.full((n, n), -np.inf)
    earned[tails(process), process.heads] = process.rewards
    earned[:, process.target] += process.target_reward
    # where there is no move, and after the target, nothing comes
    ended = (np.diff(process.first) == 0) | (np.arange(n) == process.target)
    values = np.where(ended, 0.0, process.target_reward)
    for _ in range(math.ceil(-40.0 / math.log(max(gamma, 1e-9)))):
        values = np.where(ended, 0.0, (earned + gamma * values).max(axis=1))
    return values


@own.few
@given(processes(), discounts)
def test_with_a_discount_values_are_those_of_a_long_horizon(process: DecisionProcess, gamma: float) -> None:
    values = value_iteration(process, gamma=gamma)
    moving = within_reach(process)
    scale = process.target_reward + np.abs(process.rewards).max(initial=0.0) / (1.0 - gamma)
    np.testing.assert_allclose(values.states[moving], by_horizon(process, gamma)[moving], atol=1e-12 * scale)
    # Bellman's equation holds to the last bit
    after = np.where(process.heads == process.target, 0.0, values.states[process.heads])
    np.testing.assert_array_equal(values.moves, process.earned + gamma * after)
    for s in moving:
        assert values.states[s] == values.moves[process.first[s] : process.first[s + 1]].max()


@own.few
@given(problems, resolutions, st.floats(0.05, 0.99))
def test_with_a_reward_at_the_goal_only_the_fewest_moves_count(
    problem: cg.Problem, resolution: int | tuple[int, int], gamma: float
) -> None:
    process = decision_process(problem.on_eight_connected(resolution), reward="goal_only", target_reward=3.0)
    values = value_iteration(process, gamma=gamma)
    moves = nx.single_source_shortest_path_length(process.on.graph.to_networkx(), process.target)
    for s in within_reach(process):
        expected = 3.0 * gamma ** (moves[s] - 1) if s in moves else 0.0
        assert values.states[s] == pytest.approx(expected, rel=1e-12)


def test_rewards_by_hand() -> None:
    """The risk of a move is that of the node where it leads, for moves of any length."""
    field = cg.RiskField([cg.Threat(1.0, 0.0, spread=0.2, peak=0.5)])
    on = cg.Problem((0.0, 0.0), (0.0, 1.0), field, k=4.0).on_eight_connected(2)
    by_node = decision_process(on, reward="node")
    assert by_node.heads[:3].tolist() == [1, 2, 3]
    far, near = field.density(np.array([[1.0, 1.0], [0.0, 1.0]]))
    expected = [-1.0 - 4.0 * 0.5, -1.0 - 4.0 * near, -math.sqrt(2.0) - 4.0 * far]
    np.testing.assert_allclose(by_node.rewards[:3], expected, rtol=1e-12)
    aware = decision_process(on)
    np.testing.assert_array_equal(aware.rewards[:3], -on.graph.weights_from(0)[1:])
    assert not decision_process(on, reward="goal_only").rewards.any()
    rewarded = decision_process(on, target_reward=7.0)
    assert rewarded.earned[rewarded.heads == 2].tolist() == (rewarded.rewards[rewarded.heads == 2] + 7.0).tolist()
    assert (rewarded.earned == rewarded.rewards).sum() == rewarded.n_moves - 3


def test_what_value_iteration_refuses() -> None:
    on = ONE.on_eight_connected(4)
    for gamma in (-0.1, 1.1, math.nan):
        with pytest.raises(ProblemError, match="gamma"):
            value_iteration(decision_process(on), gamma=gamma)
    for reward in (-1.0, math.inf):
        with pytest.raises(ProblemError, match="target_reward"):
            decision_process(on, target_reward=reward)
    with pytest.raises(ProblemError, match="goal_only"):
        least_target_reward(ONE, gamma=0.9, reward="goal_only")  # type: ignore[arg-type]


# The least reward at the target (C25)


def least_by_moves(process: DecisionProcess, gamma: float) -> float:
    """
    Return it by the number of moves ``n``: the least ``D_n(s) = (C_n(s) - L(s)) / gamma ** (n - 1)``.

    ``C_n`` is the least discounted cost of reaching the target by ``n`` moves, ``L`` that of going on forever. With
    what a move costs above the best endless way, ``A = c + gamma L(s') - L(s)``, it is ``D_n(s) = min(A / gamma **
    (n - 1) + D_n-1(s'))``, which loses no digits.
    """
    n = process.n_states
    cost = np.full((n, n), np.inf)
    cost[tails(process), process.heads] = -process.rewards
    into = cost[:, process.target].copy()
    into[process.target] = np.inf
    cost[:, process.target] = np.inf
    endless = np.zeros(n)
    for _ in range(math.ceil(-40.0 / math.log(gamma))):
        endless = (cost + gamma * endless).min(axis=1)
    # nothing goes on forever from where there is no move, or none but into the target
    endless[np.isinf(endless)] = 1e300
    above = cost + gamma * endless - endless[:, None]
    above[above < 1e-12 * np.abs(process.rewards).max(initial=1.0)] = 0.0
    by_moves = [into - endless]
    for moves in range(2, 2 * n):
        by_moves.append((above / gamma ** (moves - 1) + by_moves[-1]).min(axis=1))
    return max(0.0, min(float(one[process.source]) for one in by_moves))


@own.few
@given(problems, st.integers(2, 6), st.floats(0.3, 0.95), st.sampled_from(["risk_aware", "node"]))
def test_least_target_reward_by_another_way(problem: cg.Problem, side: int, gamma: float, reward: Reward) -> None:
    on = problem.on_eight_connected(side)
    process = decision_process(on, reward=reward)
    found = least_target_reward(problem, gamma=gamma, reward=reward, resolution=side)  # type: ignore[arg-type]
    expected = least_by_moves(process, gamma)
    if not cg.solve(problem, EightDirection(side)).status.has_path:
        assert found == expected == math.inf
        return
    scale = np.abs(process.rewards).max() / (1.0 - gamma)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8 * scale)


def test_no_reward_is_needed_without_discount_and_none_helps_without_future() -> None:
    assert least_target_reward(GUARDED, gamma=1.0) == 0.0
    assert least_target_reward(GUARDED, gamma=0.0) == math.inf


def test_the_least_target_reward_decides_whether_the_learner_arrives() -> None:
    least = least_target_reward(GUARDED, gamma=0.9, resolution=6)
    assert 0.0 < least < math.inf
    for share, status in ((1.05, cg.Status.FOUND), (0.95, cg.Status.STUCK), (0.0, cg.Status.STUCK)):
        learner = QLearning(gamma=0.9, target_reward=share * least, resolution=6, episodes=20_000, tolerance=0.0)
        assert learner.solve(GUARDED).status is status
    process = decision_process(GUARDED.on_eight_connected(6))
    for reward, arrives in ((least, True), (least * (1.0 - 4.0 * REWARD_TOLERANCE), False)):
        rewarded = dataclasses.replace(process, target_reward=reward)
        rollout = greedy(rewarded, value_iteration(rewarded, gamma=0.9).moves)
        assert (rollout.states[-1] == process.target) is arrives


@pytest.mark.parametrize("seed", range(5))
def test_on_maps_of_scattered_threats_it_rises_with_k(seed: int) -> None:
    problem = random_scenario(seed).problem
    least = [least_target_reward(dataclasses.replace(problem, k=k), gamma=0.95) for k in (0.0, 10.0, 200.0)]
    assert sorted(least) == least
    assert least[0] < least[-1] < math.inf


def test_it_may_also_fall_with_k() -> None:
    """C25's counterexample: a short circle beside the start is cheap until a threat around it weighs enough."""
    at = 2.0 / 19.0
    field = cg.RiskField([cg.Threat(at, at, spread=0.1)])
    problem = cg.Problem((at + 0.02, at), (0.9, 0.9), field)
    least = [least_target_reward(dataclasses.replace(problem, k=k), gamma=0.95) for k in (0.0, 1.0, 10.0)]
    assert least[0] > least[1] > least[2] == 0.0


# The learner's loop


def test_random_numbers_are_those_of_splitmix64() -> None:
    """The first numbers from 1234567 that its authors' code gives."""
    known = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    state = np.uint64(1234567)
    with np.errstate(over="ignore"):
        states = state + kernels.GOLDEN * np.arange(1, 5, dtype=np.uint64)
    assert [int(kernels.mixed(one)) for one in states] == known
    assert [word for word, _ in zip(plain.words(1234567), known, strict=False)] == known
    assert all(kernels.uniform(one) == (word >> 11) * 2.0**-53 for one, word in zip(states, known, strict=True))


def learnt(process: DecisionProcess, **settings: Any) -> tuple[FloatArray, tuple[int, int, bool]]:  # noqa: ANN401
    """Train on all states that have moves, from values that no move can beat by default."""
    chosen = {
        "alpha": 1.0,
        "gamma": 1.0,
        "epsilon": 0.3,
        "last_epsilon": 0.01,
        "episodes": 30,
        "max_steps": 20,
        "tolerance": 0.0,
        "quiet": 50,
        "seed": 1,
    }
    values = np.full(process.n_moves, settings.pop("initial_value", process.target_reward))
    chosen |= settings
    starts = np.array(within_reach(process), dtype=np.int64)
    visits = np.zeros(process.n_moves, dtype=np.int64)
    counts = kernels.train(
        process.first, process.heads, process.earned, process.target, starts, *chosen.values(), values, visits
    )
    assert visits.sum() == counts[1]
    return values, counts


@own.few
@given(
    processes(),
    st.sampled_from([1.0, 0.5, 0.1, 0.0]),
    st.sampled_from([1.0, 0.9, 0.0]),
    st.tuples(*[st.sampled_from([0.0, 0.3, 1.0])] * 2),
    st.integers(1, 40),
    drawn.seeds,
)
def test_the_loop_is_that_of_plain_python(
    process: DecisionProcess, alpha: float, gamma: float, epsilon: tuple[float, float], episodes: int, seed: int
) -> None:
    assume(within_reach(process))
    tolerance, quiet = 0.01, 3
    values, counts = learnt(
        process,
        alpha=alpha,
        gamma=gamma,
        epsilon=epsilon[0],
        last_epsilon=epsilon[1],
        episodes=episodes,
        tolerance=tolerance,
        quiet=quiet,
        seed=seed,
    )
    earned = process.earned.tolist()
    moves = [
        [(m, int(process.heads[m]), earned[m]) for m in range(process.first[s], process.first[s + 1])]
        for s in range(process.n_states)
    ]
    expected = [process.target_reward] * process.n_moves
    counted = plain.train(
        moves,
        process.target,
        within_reach(process),
        expected,
        alpha=alpha or None,
        gamma=gamma,
        epsilon=epsilon,
        episodes=episodes,
        max_steps=20,
        tolerance=tolerance,
        quiet=quiet,
        seed=seed,
    )
    assert counts == counted
    # 1 / n ** 0.7 may be rounded in two ways
    np.testing.assert_allclose(values, expected, rtol=0.0 if alpha else 1e-12, atol=0.0 if alpha else 1e-12)


@own.few
@given(processes(), st.sampled_from([1.0, 0.3, 0.0]), discounts | st.just(1.0), st.integers(1, 300), drawn.seeds)
def test_values_stay_on_the_side_of_the_exact_ones_where_they_began(
    process: DecisionProcess, alpha: float, gamma: float, episodes: int, seed: int
) -> None:
    """High ones never make a move look worse than it is, low ones never better."""
    assume(within_reach(process))
    exact = value_iteration(process, gamma=gamma).moves
    settings = {"alpha": alpha, "gamma": gamma, "episodes": episodes, "seed": seed}
    scale = process.target_reward + np.abs(process.rewards).max() * (process.n_states + 20 * episodes)
    high, _ = learnt(process, **settings)
    assert (high >= exact - 1e-12 * scale).all()
    start = QLearning(gamma=gamma)._first_value(process)
    low, _ = learnt(process, **settings, initial_value=start)
    # elsewhere, circling is all there is
    reach = csgraph.connected_components(process.on.graph.to_csgraph(), directed=False)[1]
    with_goal = reach[tails(process)] == reach[process.target]
    assert (low <= exact + 1e-12 * scale)[with_goal].all()


@own.few
@given(problems, resolutions, st.integers(1, 300), drawn.seeds)
def test_best_moves_never_circle_among_values_above_the_first(
    problem: cg.Problem, resolution: int | tuple[int, int], episodes: int, seed: int
) -> None:
    """After any training: such a value is the cost of a way once made, or the moves lead along a better one."""
    process = decision_process(problem.on_eight_connected(resolution))
    assume(within_reach(process))
    start = QLearning()._first_value(process)
    values, _ = learnt(process, episodes=episodes, seed=seed, initial_value=start)
    for s in within_reach(process):
        worth = values[process.first[s] : process.first[s + 1]].max()
        if worth <= start:
            continue
        on = dataclasses.replace(process.on, source=s)
        rollout = greedy(dataclasses.replace(process, on=on), values)
        assert rollout.states[-1] == process.target
        assert process.on.evaluate(rollout.states) <= -worth * (1.0 + 1e-12)


@own.few
@given(processes(), discounts, drawn.seeds)
def test_the_learner_learns_what_value_iteration_knows(process: DecisionProcess, gamma: float, seed: int) -> None:
    """With random moves only, all values are learnt; at rate 1 up to the rounding, at others ever closer."""
    assume(within_reach(process))
    exact = value_iteration(process, gamma=gamma).moves
    scale = process.target_reward + np.abs(process.rewards).max() / (1.0 - gamma)
    known = tails(process) != process.target
    wandering = {"epsilon": 1.0, "last_epsilon": 1.0, "gamma": gamma, "seed": seed, "max_steps": 50}
    values, _ = learnt(process, **wandering, episodes=30_000)
    np.testing.assert_allclose(values[known], exact[known], atol=1e-9 * scale)


def test_falling_rates_approach_the_exact_values() -> None:
    """``1 / n ** 0.7`` meets the conditions of Watkins and Dayan; every tenfold training is closer."""
    process = decision_process(GUARDED.on_eight_connected(5), target_reward=2.0)
    exact = value_iteration(process, gamma=0.8).moves
    known = tails(process) != process.target
    wandering = {"epsilon": 1.0, "last_epsilon": 1.0, "gamma": 0.8, "alpha": 0.0}
    errors = [
        np.abs(learnt(process, **wandering, episodes=episodes)[0] - exact)[known].max()
        for episodes in (100, 1000, 10_000, 100_000)
    ]
    assert all(after < 0.5 * before for before, after in itertools.pairwise(errors))
    assert errors[-1] < 0.01 * np.abs(exact[known]).max()


# The planner


@own.few
@given(problems, resolutions, corner_rules, st.integers(0, 100))
def test_never_cheaper_than_eight_directions_and_no_path_where_they_have_none(
    problem: cg.Problem, resolution: int | tuple[int, int], rule: CornerRule, seed: int
) -> None:
    answer = cg.solve(problem, QLearning(resolution=resolution, corner_rule=rule, seed=seed))
    best = cg.solve(problem, EightDirection(resolution, rule))
    assert answer.status in {cg.Status.FOUND, cg.Status.STUCK, cg.Status.NO_PATH}, answer.message
    assert (answer.status is cg.Status.NO_PATH) == (best.status is cg.Status.NO_PATH)
    if answer.status.has_path:
        assert problem.evaluate(answer.path).feasible
        assert answer.cost >= best.cost * (1.0 - 1e-12)
        positions = problem.on_eight_connected(resolution, corner_rule=rule).graph.positions
        np.testing.assert_array_equal(np.asarray(positions)[list(answer.nodes)], answer.path)


@own.few
@given(problems, st.integers(2, 9), st.integers(0, 100))
def test_with_long_training_it_is_eight_direction(problem: cg.Problem, resolution: int, seed: int) -> None:
    thorough = QLearning(resolution=resolution, seed=seed, episodes=20_000, last_epsilon=1.0, tolerance=0)
    answer = cg.solve(problem, thorough)
    best = cg.solve(problem, EightDirection(resolution))
    assert answer.status.has_path == best.status.has_path
    assert answer.cost == best.cost or answer.cost == pytest.approx(best.cost, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_the_defaults_learn_the_optimum_of_random_maps(seed: int) -> None:
    """C53: high performance on a known map."""
    problem = random_scenario(seed).problem
    answer = cg.solve(problem, QLearning(seed=seed))
    assert answer.cost == pytest.approx(cg.solve(problem, "eight-direction").cost, rel=1e-4)
    assert re.fullmatch(r"settled after \d+ of 8000 episodes, \d+ updates", answer.message)


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios(name: str) -> None:
    scenario = load_scenario(name)
    answer = cg.solve(scenario.problem, "q-learning", resolution=scenario.lattice)
    best = cg.solve(scenario.problem, "eight-direction", resolution=scenario.lattice)
    assert answer.cost == pytest.approx(best.cost, rel=1e-4)
    assert answer.evaluations == best.evaluations


def test_stuck_says_where() -> None:
    """With a discount and nothing at the goal, the best moves go to and fro in the cheapest place."""
    answer = cg.solve(GUARDED, QLearning(gamma=0.9))
    assert answer.status is cg.Status.STUCK
    found = re.fullmatch(
        r"the greedy policy runs in a circle of (\d+) moves from \((.+), (.+)\); .* episodes, \d+ updates",
        answer.message,
    )
    assert found
    assert len(answer.path) == 0
    n, x, y = int(found[1]), float(found[2]), float(found[3])
    process = decision_process(GUARDED.on_eight_connected(20))
    rollout = greedy(process, value_iteration(process, gamma=0.9).moves)
    assert rollout.circle == n == 2
    assert np.hypot(x - 1.0, y - 1.0) > 0.2
    assert len(set(rollout.states)) == len(rollout.states)


def test_stuck_with_too_little_training() -> None:
    answer = cg.solve(ONE, QLearning(episodes=10))
    assert answer.status is cg.Status.STUCK
    assert "10 episodes" in answer.message
    assert "settled" not in answer.message


def test_high_first_values_fall_slowly_on_a_short_move() -> None:
    """A start beside a lattice point: to and fro between the two costs next to nothing."""
    at = 2.0 / 19.0
    beside = dataclasses.replace(ONE, start=(at + 1e-5, at))
    high = QLearning(initial_value=0.0, epsilon=0.3)
    assert cg.solve(ONE, high).cost == pytest.approx(cg.solve(ONE, "eight-direction").cost, rel=1e-4)
    stuck = cg.solve(beside, high)
    assert stuck.status is cg.Status.STUCK
    assert f"in a circle of 2 moves from ({at + 1e-5:g}, {at:g})" in stuck.message
    best = cg.solve(beside, "eight-direction")
    assert cg.solve(beside, QLearning()).cost == pytest.approx(best.cost, rel=1e-4)


def test_slow_rates_need_more_episodes() -> None:
    best = cg.solve(ONE, "eight-direction").cost
    assert cg.solve(ONE, QLearning(alpha=0.1)).cost > 1.01 * best
    patient = QLearning(alpha=0.1, episodes=50_000, last_epsilon=1.0)
    assert cg.solve(ONE, patient).cost == pytest.approx(best, rel=1e-4)


def test_circles_are_counted_from_where_they_begin() -> None:
    """From state 0 by way of 1 to 2, 5, 4 and back to 1: four moves, and the way there is none of them."""
    process = decision_process(cg.Problem((0.0, 0.0), (1.0, 1.0)).on_eight_connected(3))
    values = np.zeros(process.n_moves)
    for here, there in ((0, 1), (1, 2), (2, 5), (5, 4), (4, 1)):
        row = slice(process.first[here], process.first[here + 1])
        values[row] = np.where(process.heads[row] == there, 1.0, 0.0)
    rollout = greedy(process, values)
    assert (rollout.states, rollout.circle, rollout.circle_from) == ((0, 1, 2, 5, 4), 4, 1)


def test_no_fly_areas_are_flown_around_or_there_is_no_path(monkeypatch: pytest.MonkeyPatch) -> None:
    for problem in (WALLED_IN, dataclasses.replace(WALLED_IN, start=WALLED_IN.goal, goal=WALLED_IN.start)):
        # the learner does not wander where it cannot learn anything
        with monkeypatch.context() as without:
            without.delattr(QLearning, "_train")
            answer = cg.solve(problem, QLearning())
        assert answer.status is cg.Status.NO_PATH
    wall = shapely.box(0.45, -0.1, 0.55, 0.9)
    around = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=wall), QLearning())
    assert around.status is cg.Status.FOUND
    assert around.path[:, 1].max() >= 0.9


def test_states_beyond_reach_do_not_keep_it_from_settling() -> None:
    """In a closed room, values fall without end; no episode begins there."""
    ring = shapely.box(0.0, 0.5, 0.5, 1.0).difference(shapely.box(0.1, 0.6, 0.4, 0.9))
    answer = cg.solve(cg.Problem((0.9, 0.1), (0.9, 0.9), no_fly=ring), QLearning())
    assert answer.message.startswith("settled")


def test_moves_that_earn_something_are_refused() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImproperFieldWarning)
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=8.0), cg.Threat(0.55, 0.5, 0.1, peak=8.0)], improper=True)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0)
    with pytest.raises(ProblemError, match="above 0"):
        decision_process(problem.on_eight_connected(20))


@pytest.mark.parametrize("reward", ["risk_aware", "node", "goal_only"])
def test_options_of_the_paper_learn_the_policy_of_their_own_value_iteration(reward: Reward) -> None:
    """A discount below 1 with a reward at the goal: its optimum is another one, and costs more."""
    for seed in range(3):
        problem = random_scenario(seed).problem
        learner = QLearning(reward=reward, gamma=0.9, target_reward=50.0, tolerance=0.0)
        answer = cg.solve(problem, learner)
        assert answer.status is cg.Status.FOUND
        process = decision_process(problem.on_eight_connected(20), reward=reward, target_reward=50.0)
        moves = value_iteration(process, gamma=0.9).moves

        def worth(states: tuple[int, ...], process: DecisionProcess = process) -> float:
            made = [
                np.flatnonzero((tails(process) == a) & (process.heads == b))[0] for a, b in itertools.pairwise(states)
            ]
            return float(np.sum(process.earned[made] * 0.9 ** np.arange(len(made))))

        assert worth(tuple(answer.nodes)) == pytest.approx(worth(greedy(process, moves).states), rel=1e-6)
        assert answer.cost >= cg.solve(problem, "eight-direction").cost * (1.0 - 1e-12)


# Missions


@pytest.mark.parametrize("seed", [0, 1])
def test_it_flies_with_limited_information(seed: int) -> None:
    scenario = random_scenario(seed)
    world = cg.World(scenario.problem.field, scenario.problem.bounds)
    uav = cg.Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2, k=10.0)
    flights = [cg.Mission(world, [uav], cg.solvers.get(name)).fly() for name in ("q-learning", "eight-direction")]
    learner, best = flights
    assert learner.all_arrived
    assert learner.cost <= 1.2 * best.cost
