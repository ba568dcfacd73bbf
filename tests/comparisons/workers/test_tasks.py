"""Tasks with dependencies: each runs once, after those that it needs, and finished ones do not run again."""

import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.comparisons.workers.tasks import Key, Results, Task, run_tasks
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.limits import NO_LIMITS, Limits
from cgla_graph.isolation.outcome import Failure, Outcome


class Kept(dict[Key, Any]):
    """A store in memory that says what it was given."""

    def add(self, key: Key, result: Any) -> Any:  # noqa: ANN401 - any result
        assert key not in self
        self[key] = result
        return result


def summed(*numbers: int) -> int:
    """Return one more than the sum of some numbers, of which the last are limits."""
    return 1 + sum(numbers[:-1])


def tasks_of(needs: dict[int, list[int]], begun: list[int]) -> list[Task]:
    """Make tasks, each of which says when it begins."""

    def task(number: int) -> Task:
        def arguments(done: Results) -> list[int]:
            begun.append(number)
            return [done["n", need] for need in needs[number]]

        return Task(("n", number), summed, arguments, needs=[("n", need) for need in needs[number]])

    return [task(number) for number in needs]


@pytest.mark.slow
@few
@given(seed=st.integers(0, 2**32), size=st.integers(0, 12), workers=st.integers(0, 3), data=st.data())
def test_each_is_made_once_after_what_it_needs(seed: int, size: int, workers: int, data: st.DataObject) -> None:
    draw = random.Random(seed)  # noqa: S311 - no secret
    needs = {number: [other for other in range(number) if draw.random() < 0.3] for number in range(size)}
    expected: dict[Key, int] = {}
    for number, some in needs.items():
        expected["n", number] = 1 + sum(expected["n", need] for need in some)
    order = data.draw(st.permutations(list(needs)))
    done = Kept({("n", number): expected["n", number] for number in order if draw.random() < 0.3})
    before, begun = set(done), list[int]()
    tasks = tasks_of({number: needs[number] for number in order}, begun)
    ended = []
    for task, result in run_tasks(tasks, done, limits=Limits(), workers=workers):
        # it is stored before it is yielded
        assert done[task.key] == result
        assert all(key in done for key in task.needs)
        ended.append(task.key)
    assert done == expected
    assert sorted(begun) == sorted(number for number in needs if ("n", number) not in before)
    assert set(ended) == expected.keys() - before
    if workers == 0:
        assert ended == [("n", number) for number in begun]


def test_of_what_is_ready_the_first_begins() -> None:
    begun: list[int] = []
    needs = {3: [0, 1], 2: [1], 1: [], 0: []}
    assert [result for _, result in run_tasks(tasks_of(needs, begun), limits=Limits(), workers=0)] == [1, 2, 1, 3]
    assert begun == [1, 2, 0, 3]


def test_what_cannot_begin_is_told() -> None:
    with pytest.raises(ValueError, match=r"\('n', 1\) needs \('n', 7\), which is no task and not in the store"):
        list(run_tasks(tasks_of({1: [7]}, []), limits=Limits(), workers=0))
    with pytest.raises(ValueError, match="needs what needs it in turn"):
        list(run_tasks(tasks_of({1: [2], 2: [1], 3: []}, []), limits=Limits(), workers=0))
    # what the store holds need not be a task
    ((_, result),) = run_tasks(tasks_of({1: [7]}, []), Kept({("n", 7): 5}), limits=Limits(), workers=0)
    assert result == 6


def fails(limits: Limits) -> None:
    """Raise."""
    msg = f"within {limits.seconds}"
    raise ValueError(msg)


def test_a_failure_is_a_result_of_what_its_task_makes_of_it() -> None:
    def told(outcome: Outcome, limits: Limits, _: Results) -> tuple[Failure | None, str, Limits]:
        return outcome.failure, outcome.message, limits

    task = Task(("f",), fails, result=told)
    # tasks in this process have no limits
    ((_, here),) = run_tasks([task], limits=Limits(seconds=5.0), workers=0)
    assert here == (Failure.RAISED, "ValueError: within inf", NO_LIMITS)
    ((_, there),) = run_tasks([task], limits=Limits(seconds=5.0), workers=1)
    assert there == (Failure.RAISED, "ValueError: within 5.0", Limits(seconds=5.0))


def lacks(file: str, error: type[Exception], _: Limits) -> int:
    """Raise an error until a file is there."""
    if not Path(file).exists():
        raise error
    return 1


@pytest.mark.parametrize(
    ("error", "workers"),
    [
        (ModuleNotFoundError, 0),
        (FileNotFoundError, 0),
        (WorkerError, 0),
        pytest.param(ModuleNotFoundError, 2, marks=pytest.mark.slow),
    ],
)
def test_tasks_that_the_environment_stops_are_made_the_next_time(
    error: type[Exception], workers: int, tmp_path: Path
) -> None:
    """The others are made, but for those that need them; at the end, an error says so."""
    file = tmp_path / "file"

    def tasks() -> list[Task]:
        return [
            Task(("n", "needing"), summed, lambda done: (done["n", "lacking"],), needs=[("n", "lacking")]),
            Task(("n", "lacking"), lacks, (str(file), error)),
            Task(("n", "other"), summed, (1,)),
        ]

    kept = Kept()
    with pytest.raises(WorkerError, match=f"^2 tasks could not be made, lacking because: {error.__name__}; .*--resume"):
        list(run_tasks(tasks(), kept, limits=Limits(), workers=workers))
    assert kept == {("n", "other"): 2}
    file.touch()
    list(run_tasks(tasks(), kept, limits=Limits(), workers=workers))
    assert kept == {("n", "other"): 2, ("n", "lacking"): 1, ("n", "needing"): 2}
