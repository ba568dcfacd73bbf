"""The queue of fast marching, against a list that is sorted anew for every node that leaves."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.eikonal import queue_kernels as queue
from cgla_graph.testing import strategies as drawn

#: How a node is added to a heap (`queue_kernels.push`).
Push = Callable[[FloatArray, WholeArray, int, float, int], int]


class Front:
    """A queue of nodes and their times, as fast marching uses it; `cost` is one over the speed; a step is 1 long."""

    def __init__(self, cost: FloatArray, speed: float, room: int, push: Push = queue.push) -> None:
        n = len(cost)
        self.times, self.final, self.cost = np.full(n, math.inf), np.full(n, math.inf), cost
        self.keys, self.items = np.full(room, math.inf), np.empty(room, dtype=np.uint32)
        self.heads = np.full(queue.BUCKETS + 1, queue.NONE, dtype=np.uint32)
        self.entries = np.column_stack([np.zeros(room), np.arange(1, room + 1)]).astype(np.uint32)
        self.speed, self.push = speed, push
        # all wait for the first round
        self.bucket, self.begin, self.per_time = queue.BUCKETS - 1, math.inf, 0.0
        self.size, self.waiting, self.free = 0, 0, 0
        # entries that were looked at for rounds
        self.looked_at = 0

    def put(self, node: int, time: float) -> None:
        self.times[node] = time
        bucket = queue.BUCKETS if self.begin == math.inf else queue.bucket_of(time, self.begin, self.per_time)
        if bucket <= self.bucket:
            self.size = self.push(self.keys, self.items, self.size, time, node)
            return
        if self.size + self.waiting + 8 > len(self.keys):
            self.keys, self.items, self.entries, self.free = queue.grown(self.keys, self.items, self.entries, self.free)
        self.free = queue.put_off(node, bucket, self.free, self.heads, self.entries)
        self.waiting += 1

    def take(self) -> int:
        """Return the node that leaves next, which is done then; -1 if there is none."""
        while self.size + self.waiting:
            if self.size == 0:
                self.bucket = queue.next_bucket(self.bucket, self.heads)
                nodes, buckets = (self.times, self.final), (self.heads, self.entries)
                if self.bucket == queue.BUCKETS:
                    self.bucket = 0
                    self.looked_at += self.waiting
                    self.begin, self.per_time = queue.begin_round(self.speed, 1.0, *nodes, self.cost, *buckets)
                opened = queue.open_bucket(
                    self.bucket, self.waiting, self.free, *nodes, self.keys, self.items, *buckets
                )
                self.size, self.waiting, self.free = opened
                continue
            node = int(self.items[0])
            self.size = queue.drop_first(self.keys, self.items, self.size)
            if self.final[node] == math.inf:
                self.final[node] = self.times[node]
                return node
        return -1


def check_order(seed: int, spread: float, speed: float, push: Push = queue.push) -> None:
    """Nodes come and fall at random, by steps of very different length, and leave in the order of their times."""
    rng = np.random.default_rng(seed)
    n = 60
    begin = float(rng.choice([0.0, -3.0, 1e3]))
    front = Front(np.exp(3.0 * spread * rng.standard_normal(n)), speed, 16, push)
    times = np.full(n, math.inf)
    left: list[int] = []

    def offer(now: float, count: int) -> None:
        for node in rng.integers(n, size=count).tolist():
            time = now + float(np.exp(spread * rng.standard_normal()))
            if time < times[node] and node not in left:
                times[node] = time
                front.put(node, time)

    offer(begin, 5)
    while (node := front.take()) >= 0:
        waiting = [p for p in range(n) if math.isfinite(times[p]) and p not in left]
        assert times[node] == min(times[p] for p in waiting)
        left.append(node)
        offer(float(times[node]), int(rng.integers(4)))
    assert sorted(left) == np.flatnonzero(np.isfinite(times)).tolist()


@given(drawn.seeds, st.sampled_from([0.1, 1.0, 10.0]), st.sampled_from([1e-5, 1e-2, 0.3, 1e4, 1e12]))
@strategies.usual
def test_nodes_leave_in_the_order_of_their_times(seed: int, spread: float, speed: float) -> None:
    """Within a bucket, in one round, and over many rounds at once."""
    check_order(seed, spread, speed)


def looked_at(cost: float, steps: float) -> float:
    """
    Return how many entries rounds look at, for each that leaves, in a front of nodes that take `steps` of time.

    The mean speed of the map is 1.
    """
    rng, n = np.random.default_rng(1), 5000
    front = Front(np.full(n, cost), 1.0, 1000)
    for node in range(50):
        front.put(node, steps * rng.uniform())
    following = 50
    while (node := front.take()) >= 0:
        if following < n:
            front.put(following, front.times[node] + steps * (0.5 + rng.uniform()))
            following += 1
    assert following == n
    assert np.isfinite(front.final).all()
    return front.looked_at / n


def test_a_front_that_is_nowhere_fast_goes_through_few_rounds() -> None:
    """Else every round would look at all of it, for a node or two; so it is if costs are not known."""
    assert looked_at(cost=1e5, steps=1e5) <= 1
    assert looked_at(cost=1.0, steps=1.0) <= 1
    assert looked_at(cost=1.0, steps=1e5) >= 30


def test_a_heap_that_is_none_is_found_out() -> None:
    def pile(keys: FloatArray, items: WholeArray, size: int, key: float, item: int) -> int:
        keys[size], items[size] = key, item
        return size + 1

    with pytest.raises(AssertionError):
        check_order(1, 1.0, 1e-3, pile)
