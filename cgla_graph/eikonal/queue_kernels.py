"""
Compiled kernels of a queue of nodes by their times: a heap of those that are due, and buckets for later ones.

A round divides a span of time into buckets of equal width (Dial 1969); later entries wait for the next round, which
begins at the earliest of them. Only the nodes of the current bucket are put in order, in a heap, so that nodes leave
the queue in the order of their times, but most entries are compared with only a few others. Outdated entries, of nodes
that are done, are dropped when their bucket is opened.

An entry is a row of `entries`: a node, and the next entry of its bucket or of the free ones. `heads` has the first
entry of each bucket, and last of the later entries. Kernels take arrays one by one and return only numbers: so numba
need not count references in the loop that calls them, which would take as long as the rest of it. Kernels in that loop
take few arrays: passing the whole queue costs a fifth of the time or more.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray

#: Buckets of a round, and what stands for no entry.
BUCKETS = 4096
NONE = np.uint32(2**32 - 1)
#: Buckets to a step of a front of mean speed; and how many times as slow a front may be until they get wider.
PARTS, SLOW = 128.0, 16.0


@kernel
def push(keys: FloatArray, items: WholeArray, size: int, key: float, item: int) -> int:
    """Add an item to a heap of `size` items, four children a parent; return the new size. Unused keys are infinite."""
    i = size
    while i > 0:
        parent = (i - 1) >> 2
        if keys[parent] <= key:
            break
        keys[i] = keys[parent]
        items[i] = items[parent]
        i = parent
    keys[i] = key
    items[i] = item
    return size + 1


@kernel
def drop_first(keys: FloatArray, items: WholeArray, size: int) -> int:
    """
    Take the item of least key, at place 0, out of a heap of `size` items; return the new size.

    The hole sinks to a leaf along the least children, which needs no branch that is hard to predict; the last item
    rises from there.
    """
    size -= 1
    key = keys[size]
    item = items[size]
    keys[size] = math.inf
    i = int(np.int64(0))
    while True:
        first = 4 * i + 1
        if first >= size:
            break
        low = first + int(keys[first + 1] < keys[first])
        high = first + 2 + int(keys[first + 3] < keys[first + 2])
        child = low if keys[low] <= keys[high] else high
        keys[i] = keys[child]
        items[i] = items[child]
        i = child
    return push(keys, items, i, key, item) - i - 1 + size


@kernel
def bucket_of(time: float, begin: float, per_time: float) -> int:
    """Return the bucket of a time in a round: `BUCKETS` if it is further ahead, and 0 or less up to `begin`."""
    return int(min((time - begin) * per_time, float(BUCKETS)))


@kernel
def link(entry: int, bucket: int, heads: WholeArray, entries: WholeArray) -> None:
    """Put an entry into a bucket."""
    entries[entry, 1] = heads[bucket]
    heads[bucket] = entry


@kernel
def put_off(node: int, bucket: int, free: int, heads: WholeArray, entries: WholeArray) -> int:
    """Put a node into a bucket that is not open yet, with the first free entry; return the next free one."""
    following = int(entries[free, 1])
    entries[free, 0] = node
    link(free, bucket, heads, entries)
    return following


@kernel
def next_bucket(bucket: int, heads: WholeArray) -> int:
    """Return the first bucket after one that holds anything, or `BUCKETS` if the round is over."""
    bucket += 1
    while bucket < BUCKETS and heads[bucket] == NONE:
        bucket += 1
    return bucket


@kernel
def begin_round(
    speed: float,
    step: float,
    times: FloatArray,
    final: FloatArray,
    cost: FloatArray,
    heads: WholeArray,
    entries: WholeArray,
) -> tuple[float, float]:
    """
    Begin a round at the soonest of the nodes that are further ahead, and put them into its buckets.

    Parameters
    ----------
    speed, step
        The mean speed of fronts and the least step of the grid. Buckets divide the time of such a step at this speed,
        unless the nodes that wait are much slower: most of their buckets would be empty.
    times, final
        Of each node its time so far, and its final time, which is infinite until it is done.
    cost
        Of each node, one over the speed of a front there.
    heads, entries
        The buckets, all of them empty but the last.

    Returns
    -------
    begin, per_time
        When the round begins, infinity if nothing is left; and its buckets per unit of time.
    """
    begin = math.inf
    total = 0.0
    count = int(np.int64(0))
    entry = heads[BUCKETS]
    while entry != NONE:
        node = entries[entry, 0]
        if final[node] == math.inf:
            begin = min(begin, times[node])
            total += 1.0 / cost[node]
            count += 1
        entry = entries[entry, 1]
    per_time = PARTS / step * min(speed, SLOW * total / max(count, 1))
    entry = heads[BUCKETS]
    heads[BUCKETS] = NONE
    while entry != NONE:
        following = entries[entry, 1]
        node = entries[entry, 0]
        # (those that are done are left out when it is opened)
        bucket = bucket_of(times[node], begin, per_time) if final[node] == math.inf else int(np.int64(0))
        link(int(np.int64(entry)), bucket, heads, entries)
        entry = following
    return begin, per_time


@kernel
def open_bucket(
    bucket: int,
    waiting: int,
    free: int,
    times: FloatArray,
    final: FloatArray,
    keys: FloatArray,
    items: WholeArray,
    heads: WholeArray,
    entries: WholeArray,
) -> tuple[int, int, int]:
    """Move the nodes of a bucket into an empty heap; return its size, the entries that wait, and the first free one."""
    entry = heads[bucket]
    heads[bucket] = NONE
    size = int(np.int64(0))
    while entry != NONE:
        following = entries[entry, 1]
        node = entries[entry, 0]
        if final[node] == math.inf:
            size = push(keys, items, size, times[node], node)
        entries[entry, 1] = free
        free = entry
        waiting -= 1
        entry = following
    return size, waiting, free


@kernel
def grown(
    keys: FloatArray, items: WholeArray, entries: WholeArray, free: int
) -> tuple[FloatArray, WholeArray, WholeArray, int]:
    """Return a heap and entries with twice the room, and the first free entry."""
    size = keys.shape[0]
    more_keys = np.empty(2 * size)
    more_items: WholeArray = np.empty(2 * size, dtype=np.uint32)
    more_entries: WholeArray = np.empty((2 * size, 2), dtype=np.uint32)
    # (numba compiles the assignment of a slice, which may be of another shape, for a second)
    for i in range(size):
        more_keys[i] = keys[i]
        more_items[i] = items[i]
        more_entries[i, 0] = entries[i, 0]
        more_entries[i, 1] = entries[i, 1]
        more_keys[size + i] = math.inf
        more_entries[size + i, 1] = free if i == 0 else size + i - 1
    return more_keys, more_items, more_entries, 2 * size - 1
