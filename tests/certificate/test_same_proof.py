"""The same problem has the same proof, whichever of the two bounds of a grid is computed first."""

import threading

import pytest

from cgla_graph.certificate import subsolution
from cgla_graph.certificate.certificate import Certificate, prove
from cgla_graph.certificate.subsolution import Level, Subsolution
from cgla_graph.scenarios.scenario import load_scenario

#: A tolerance that the bounds of both ends reach on the same grid, in different rounds.
TOLERANCE = 0.003
#: Below the wall.
PATH = [(0.2, 0.5), (0.275, 0.4), (0.499, 0.1), (0.501, 0.1), (0.725, 0.4), (0.8, 0.5)]


def proof(monkeypatch: pytest.MonkeyPatch, *, goal_first: bool) -> Certificate:
    """Prove with a race on every grid, in which one bound begins when the other has ended."""
    ended, bound = threading.Semaphore(0), Level.bound

    def in_order(level: Level, *, to_goal: bool, race: object = None, **others: object) -> Subsolution | None:
        if race is None:
            return bound(level, to_goal=to_goal, **others)
        if to_goal != goal_first:
            assert ended.acquire(timeout=60)
        try:
            return bound(level, to_goal=to_goal, race=race, **others)
        finally:
            if to_goal == goal_first:
                ended.release()

    monkeypatch.setattr(subsolution, "LARGE", 0)
    monkeypatch.setattr(Level, "bound", in_order)
    found = prove(load_scenario("thin-wall").problem, PATH, tolerance=TOLERANCE)
    monkeypatch.undo()
    return found


# fails if the race takes the better one of both bounds, which depends on the rounds that the loser has made
def test_the_order_of_threads_changes_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = (proof(monkeypatch, goal_first=goal_first) for goal_first in (True, False))
    assert len(one.grids) > 1
    assert (one.lower_bound, one.upper_bound, one.message) == (other.lower_bound, other.upper_bound, other.message)
    for here, there in zip(one.grids, other.grids, strict=True):
        assert (here.last, here.lower_bound, here.runs.tolist()) == (there.last, there.lower_bound, there.runs.tolist())
