"""The queue of fast marching, against a list that is sorted anew for every node that leaves."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.eikonal import queue_kernels
from cgla_graph.eikonal.queue_kernels import bucket_of, drop_first, grown, open_next, put_off

#: How a node is added to a heap (`queue_kernels.push`).
Push = Callable[[FloatArray, WholeArray, int, float, int], int]


class Front:
    """A queue of nodes and their times, as fast marching uses it."""

    def __init__(self, n: int, first_time: float, per_time: float, room: int, push: Push) -> None:
        self.times, self.final = np.full(n, math.inf), np.full(n, math.inf)
        self.keys, self.items = np.full(room, math.inf), np.empty(room, dtype=np.uint32)
        self.heads = np.full(queue_kernels.BUCKETS + 1, queue_kernels.NONE, dtype=np.uint32)
        self.entries = np.column_stack([np.zeros(room), np.arange(1, room + 1)]).astype(np.uint32)
        self.per_time, self.push = per_time, push
        self.current, self.size, self.waiting, self.free = bucket_of(first_time, per_time) - 1, 0, 0, 0

    def put(self, node: int, time: float) -> None:
        self.times[node] = time
        bucket = bucket_of(time, self.per_time)
        if bucket <= self.current:
            self.size = self.push(self.keys, self.items, self.size, time, node)
            return
        if self.size + self.waiting + 8 > len(self.keys):
            self.keys, self.items, self.entries, self.free = grown(self.keys, self.items, self.entries, self.free)
        self.free = put_off(node, bucket, self.current, self.free, self.heads, self.entries)
        self.waiting += 1

    def take(self) -> int:
        """Return the node that leaves next, which is done then; -1 if there is none."""
        while self.size + self.waiting:
            if self.size == 0:
                marks = self.current, self.waiting, self.free, self.per_time
                arrays = self.times, self.final, self.keys, self.items, self.heads, self.entries
                self.current, self.size, self.waiting, self.free = open_next(*marks, *arrays)
                continue
            node = int(self.items[0])
            self.size = drop_first(self.keys, self.items, self.size)
            if self.final[node] == math.inf:
                self.final[node] = self.times[node]
                return node
        return -1


def check_order(seed: int, spread: float, per_time: float, push: Push = queue_kernels.push) -> None:
    """Nodes come and fall at random, by steps of very different length, and leave in the order of their times."""
    rng = np.random.default_rng(seed)
    n = 60
    begin = float(rng.choice([0.0, -3.0, 1e3]))
    front, times = Front(n, begin, per_time, 16, push), np.full(n, math.inf)
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


@given(strategies.seeds, st.sampled_from([0.1, 1.0, 10.0]), st.sampled_from([1e-3, 1.0, 30.0, 1e6, 1e14]))
@strategies.usual
def test_nodes_leave_in_the_order_of_their_times(seed: int, spread: float, per_time: float) -> None:
    """Within a bucket, in one round, and over many rounds at once."""
    check_order(seed, spread, per_time)


def test_a_heap_that_is_none_is_found_out() -> None:
    def pile(keys: FloatArray, items: WholeArray, size: int, key: float, item: int) -> int:
        keys[size], items[size] = key, item
        return size + 1

    with pytest.raises(AssertionError):
        check_order(1, 1.0, 1e-3, pile)
