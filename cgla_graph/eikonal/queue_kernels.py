"""
Compiled kernels of a queue of nodes by their times: a heap of those that are due, and buckets for later ones.

The bucket of a time is its number of times a width (Dial 1969); the buckets of a round lie in a circle (Brown 1988),
and what is further ahead waits for the next round. Only the nodes of the bucket at hand are put in order, in a heap, so
that nodes leave the queue in the order of their times, but most entries never see more than a few others. Entries that
are out of date, of nodes that are done, are left out when their bucket is opened.

An entry is a row of `entries`: a node, and the next entry of its bucket or of the free ones. `heads` has the first
entry of each bucket, and last of those that are further ahead. Kernels take arrays one by one, and give back numbers
alone: so numba need not count references in the loop that calls them, which would take as long as the rest of it.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray

#: Buckets of a round, a power of 2; the last of them; and what stands for no entry.
BUCKETS = 4096
LAST = BUCKETS - 1
NONE = np.uint32(2**32 - 1)
#: The greatest number of a bucket: whole numbers up to there are exact.
MOST = 1e15


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
def bucket_of(time: float, per_time: float) -> int:
    """Return the bucket of a time; those before and after 0 share one."""
    return int(min(time * per_time, MOST))


@kernel
def link(entry: int, bucket: int, current: int, heads: WholeArray, entries: WholeArray) -> None:
    """Put an entry into a bucket after the `current` one, or among those that are further ahead than once around."""
    place = bucket & LAST if bucket <= current + LAST else BUCKETS
    entries[entry, 1] = heads[place]
    heads[place] = entry


@kernel
def put_off(node: int, bucket: int, current: int, free: int, heads: WholeArray, entries: WholeArray) -> int:
    """Put a node into a bucket that is not open yet, with the first free entry; return the next free one."""
    following = int(entries[free, 1])
    entries[free, 0] = node
    link(free, bucket, current, heads, entries)
    return following


@kernel
def open_next(
    current: int,
    waiting: int,
    free: int,
    per_time: float,
    times: FloatArray,
    final: FloatArray,
    keys: FloatArray,
    items: WholeArray,
    heads: WholeArray,
    entries: WholeArray,
) -> tuple[int, int, int, int]:
    """
    Move the nodes of the next bucket into an empty heap.

    Parameters
    ----------
    current
        The bucket that was open until now.
    waiting, free
        Entries in buckets, at least one; and the first free entry.
    per_time
        Buckets per unit of time.
    times, final
        Of each node its time so far, and its final time, which is infinite until it is done.
    keys, items
        A heap.
    heads, entries
        The buckets.

    Returns
    -------
    current, size, waiting, free
        The bucket that is open now, and the size of its heap: 0 if it held nothing that is not done.
    """
    current += 1
    while heads[current & LAST] == NONE and (current & LAST) != 0:
        current += 1
    if (current & LAST) == 0:
        # a new round: of those that were further ahead than the last one, what belongs to it
        first = heads[BUCKETS]
        heads[BUCKETS] = NONE
        ahead = int(np.int64(0))
        soonest = MOST
        entry = first
        while entry != NONE:
            node = entries[entry, 0]
            if final[node] == math.inf:
                soonest = min(soonest, times[node] * per_time)
            ahead += 1
            entry = entries[entry, 1]
        if ahead == waiting:
            # nothing else is left: to the round of the soonest
            current = max(current, int(soonest) & ~LAST)
        entry = first
        while entry != NONE:
            following = entries[entry, 1]
            node = entries[entry, 0]
            if final[node] == math.inf:
                link(int(np.int64(entry)), bucket_of(times[node], per_time), current, heads, entries)
            else:
                entries[entry, 1] = free
                free = entry
                waiting -= 1
            entry = following
    entry = heads[current & LAST]
    heads[current & LAST] = NONE
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
    return current, size, waiting, free


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
