"""
The weights of a graph: as a dense matrix, as a sparse one, or computed on request.

All three give the same answers: infinity where there is no edge, 0 at the node itself. They do not change when they are
asked.
"""

import math
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np
import scipy  # (its modules are imported when they are first used: hints that name them are in quotes)

from cgla_graph._types import FloatArray
from cgla_graph.errors import GraphError
from cgla_graph.model.cost_model import CostModel

#: Most nodes of an implicit graph whose weights are all computed, 8 bytes a pair: 5 GB.
MOST_HELD = 25_000
#: Up to so many nodes, free memory is not checked (288 MB).
ALWAYS_HELD = 6000
#: A smaller sum and any weight do not add up to infinity: half of the last digit of the largest float.
SAFE = 2.0**969


class Weights(Protocol):
    """The weights of a graph of ``n`` nodes: entry ``[i, j]`` weighs the edge from ``i`` to ``j``."""

    def row(self, index: int) -> FloatArray:
        """Return the weights from one node to all, shape ``(n,)``."""
        ...

    def column(self, index: int) -> FloatArray:
        """Return the weights from all nodes to one, shape ``(n,)``."""
        ...

    def entry(self, tail: int, head: int) -> float:
        """Return the weight of one ordered pair."""
        ...

    def matrix(self) -> FloatArray:
        """Return all weights, shape ``(n, n)``, read-only."""
        ...

    def matrix_to(self) -> FloatArray:
        """Return the transposed matrix, shape ``(n, n)``, row by row in memory, read-only."""
        ...

    def csgraph(self) -> "scipy.sparse.csr_array":
        """Return a new sparse matrix whose stored entries are the edges, stored zeros too."""
        ...

    @property
    def n_edges(self) -> int:
        """Number of ordered pairs with an edge."""
        ...


@dataclass(frozen=True, eq=False)
class DenseWeights:
    """
    A matrix of all weights.

    Parameters
    ----------
    values
        Shape ``(n, n)``, read-only from now on.
    """

    values: FloatArray

    def __post_init__(self) -> None:
        """Make the matrix read-only."""
        self.values.flags.writeable = False

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore pickled weights; pickling forgets that arrays are read-only."""
        self.__dict__.update(state)
        self.__post_init__()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out cached values."""
        return {"values": self.values}

    def row(self, index: int) -> FloatArray:
        """Return a view of the row."""
        return np.asarray(self.values[index])

    def column(self, index: int) -> FloatArray:
        """Return a view of the transposed matrix's row."""
        return np.asarray(self._transposed[index])

    def entry(self, tail: int, head: int) -> float:
        """Return the entry."""
        return float(self.values[tail, head])

    def matrix(self) -> FloatArray:
        """Return the matrix itself."""
        return self.values

    def matrix_to(self) -> FloatArray:
        """Return the transposed matrix."""
        return self._transposed

    def csgraph(self) -> "scipy.sparse.csr_array":
        """Pick the finite entries off the diagonal."""
        kept = np.isfinite(self.values)
        np.fill_diagonal(kept, val=False)
        # 32-bit indices, and no array of index pairs: the matrix is large enough
        columns = np.broadcast_to(np.arange(len(kept), dtype=np.int32), kept.shape)[kept]
        counts = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return scipy.sparse.csr_array((self.values[kept], columns, counts), shape=kept.shape)

    @property
    def n_edges(self) -> int:
        """Count the finite entries off the diagonal."""
        return int(np.isfinite(self.values).sum()) - len(self.values)

    @cached_property
    def _transposed(self) -> FloatArray:
        matrix = np.ascontiguousarray(self.values.T)
        matrix.flags.writeable = False
        return matrix


@dataclass(frozen=True, eq=False)
class SparseWeights:
    """
    The weights of the edges alone, row by row.

    Parameters
    ----------
    rows
        Shape ``(n, n)``: stored entries are edges, stored zeros too; none on the diagonal.
    """

    rows: "scipy.sparse.csr_array"

    def __getstate__(self) -> dict[str, Any]:
        """Leave out cached values."""
        return {"rows": self.rows}

    def row(self, index: int) -> FloatArray:
        """Spread one stored row out over all nodes."""
        return _spread(self.rows, index)

    def column(self, index: int) -> FloatArray:
        """Spread one stored column out over all nodes."""
        return _spread(self._columns, index)

    def entry(self, tail: int, head: int) -> float:
        """Look the entry up in its row."""
        if tail == head:
            return 0.0
        begin, end = self.rows.indptr[tail], self.rows.indptr[tail + 1]
        stored = self.rows.data[begin:end][self.rows.indices[begin:end] == head]
        return float(stored[0]) if len(stored) else np.inf

    def matrix(self) -> FloatArray:
        """Spread all rows out."""
        dense = np.full(self.rows.shape, np.inf)
        entries = self.rows.tocoo()
        dense[entries.coords] = entries.data
        np.fill_diagonal(dense, 0.0)
        dense.flags.writeable = False
        return dense

    def matrix_to(self) -> FloatArray:
        """Spread all columns out."""
        return SparseWeights(self._columns).matrix()

    def csgraph(self) -> "scipy.sparse.csr_array":
        """Return a copy."""
        return self.rows.copy()

    @property
    def n_edges(self) -> int:
        """Count the stored entries."""
        return int(self.rows.nnz)

    @cached_property
    def _columns(self) -> "scipy.sparse.csr_array":
        return scipy.sparse.csr_array(self.rows.T)


@dataclass(frozen=True, eq=False)
class ImplicitWeights:
    """
    Every pair of nodes joined by its straight segment, weighed by Eq. 5 on request; symmetric.

    Parameters
    ----------
    model
        The cost of a segment.
    positions
        Shape ``(n, 2)``, map units.
    lattice_shape
        As `cgla_graph.model.cost_model.CostModel.matrix` takes it.
    """

    model: CostModel
    positions: FloatArray
    lattice_shape: tuple[int, int]

    def row(self, index: int) -> FloatArray:
        """Weigh the segments between one node and all."""
        return self.model.row(self.positions, index, self.lattice_shape)

    def column(self, index: int) -> FloatArray:
        """Weigh the segments between one node and all."""
        return self.row(index)

    def entry(self, tail: int, head: int) -> float:
        """Weigh one segment."""
        return self.model.pair(self.positions, tail, head, self.lattice_shape)

    def matrix(self) -> FloatArray:
        """Weigh all pairs, on all cores, without keeping the result."""
        return self.held().values

    def matrix_to(self) -> FloatArray:
        """Weigh all pairs."""
        return self.matrix()

    def csgraph(self) -> "scipy.sparse.csr_array":
        """Weigh all pairs."""
        return self.held().csgraph()

    @property
    def n_edges(self) -> int:
        """Weigh all pairs and count those with an edge."""
        return self.held().n_edges

    def held(self) -> DenseWeights:
        """Weigh all pairs and hold their weights; raise `GraphError` for more than `MOST_HELD` nodes."""
        if too_much := beyond_holding(len(self.positions)):
            msg = f"that needs {too_much}; cg.solve(problem, 'cgla') weighs only edges that can be part of the optimum"
            raise GraphError(msg)
        return DenseWeights(self.model.matrix(self.positions, self.lattice_shape))


def beyond_holding(n_nodes: int) -> str:
    """Return how much memory all weights take if that is too much; empty if they can be held."""
    gigabytes = 8e-9 * n_nodes**2
    if n_nodes > MOST_HELD:
        limit = f"where at most {MOST_HELD} nodes are weighed at once"
    elif n_nodes > ALWAYS_HELD and gigabytes > (free := 1e-9 * free_memory()):
        limit = f"where {free:.3g} GB of memory are free"
    else:
        return ""
    return f"all weights of {n_nodes} nodes, {gigabytes:.3g} GB, {limit} (a lower resolution needs less)"


def free_memory() -> float:
    """
    Return how many bytes this process may still allocate; infinite where that is not known.

    Examples
    --------
    >>> free_memory() > 0.0
    True
    """
    free = math.inf
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024.0 * float(next(line for line in lines if line.startswith("MemAvailable")).split()[1])
    with suppress(ImportError, OSError, ValueError):
        import resource  # noqa: PLC0415 - not on Windows

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            taken = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
            free = min(free, max(0.0, limit - taken))
    return free


def reject_overflow(values: FloatArray, line: Callable[[int], FloatArray]) -> None:
    """
    Raise an error if a search found no way for a node only because its least cost is beyond the largest float.

    Parameters
    ----------
    values
        The least costs of a finished search, shape ``(n,)``; infinite where it found no way.
    line
        Gives the weights of the edges between one node and all, shape ``(n,)``: `GeometricGraph.weights_to` for costs
        to a target, `GeometricGraph.weights_from` for those from a source.

    Raises
    ------
    GraphError
        If an edge joins a node without a value to one that has one.
    """
    finite = np.isfinite(values)
    for index in np.nonzero(finite & (values >= SAFE))[0].tolist():
        if (np.isfinite(line(index)) & ~finite).any():
            refuse_sum()


def refuse_sum() -> NoReturn:
    """Raise the error of a sum of weights that is beyond the largest float."""
    msg = (
        f"the weights along a path add up to more than {sys.float_info.max:.2g}, the largest float; divide all weights "
        "by one number, or give infinity where there is no edge"
    )
    raise GraphError(msg)


def _spread(rows: "scipy.sparse.csr_array", index: int) -> FloatArray:
    """Spread one stored row out over all nodes, shape ``(n,)``: infinity where nothing is stored, 0 at the node."""
    row = np.full(rows.shape[0], np.inf)
    begin, end = rows.indptr[index], rows.indptr[index + 1]
    row[rows.indices[begin:end]] = rows.data[begin:end]
    row[index] = 0.0
    return row
