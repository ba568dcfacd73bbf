"""
Write a proof file with a surface of another method: a linear program on a coarse grid.

A surface proves a bound wherever it is from. Here it has values ``u`` at the nodes of 16 x 16 cells, which a linear
program chooses: they are as high as possible at the start, and no steeper than the cost. A slope is a length, so that it
is compared with the cost in 16 directions. What is left above the cost is known from the checker, which measures the
slopes: the surface is divided by the greatest ratio. Nothing but NumPy, SciPy and `check_proof.py` beside this file is
used. ``docs/how-it-works/proof-files.md`` has the format.

Usage: ``python other_surface.py NAME.proof``. It writes the file, and checks it.
"""

import io
import json
import sys
import zipfile
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array, vstack

sys.path.insert(0, str(Path(__file__).parent))
import check_proof  # noqa: E402 - beside this file

N, DIRECTIONS, EXPONENT = 16, 16, 40
START, GOAL = (0.15, 0.3), (0.85, 0.75)
PROBLEM = {
    "start": START,
    "goal": GOAL,
    "bounds": [0.0, 0.0, 1.0, 1.0],
    "k": 4.0,
    "threats": "threats.npy",
    "rasters": [],
    "rings": [],
    "on_earth": False,
}
#: Threats: x, y, spread, peak. The path is any one that joins both ends.
ARRAYS = {
    "threats.npy": np.array([[0.5, 0.5, 0.15, 0.6], [0.3, 0.8, 0.1, 0.8]]),
    "path.npy": np.array([START, (0.45, 0.3), (0.7, 0.45), GOAL]),
}


def read(name, kind, axes):
    """Return an array, as the checker reads it from a file."""
    return ARRAYS[name].astype(float if kind == "f" else int)


def rows(columns, weights, n):
    """Return a sparse matrix with one row for each of the given sums of values, shapes (m, 9) and (m, 9)."""
    at = np.repeat(np.arange(len(columns)), columns.shape[1])
    return coo_array((weights.ravel(), (at, columns.ravel())), shape=(len(columns), n)).tocsr()


# The checker lays the grid: cells (0, 0) to (N, N) around nodes; 3 x 3 values around each, and lower costs at 3 x 3 places.
problem = check_proof.Problem(json.loads(json.dumps(PROBLEM)), read)
grid = check_proof.Grid.over(problem, [N, N], 0, [0, N + 1, 0, N + 1])
around, n = grid.controls, int(grid.controls.max()) + 1

# Slopes at 3 x 3 places of a cell are means of differences of values, times N.
low, high = np.array([0.5, 0.5, 0.0]), np.array([0.0, 0.5, 0.5])
values = np.array([low, [0.0, 1.0, 0.0], high])
slopes = N * np.array([[-1.0, 1.0, 0.0], [-0.5, 0.0, 0.5], [0.0, -1.0, 1.0]])
end = round(GOAL[0] * N), round(GOAL[1] * N)
block = [end[0] - 1, end[0] + 2, end[1] - 1, end[1] + 2]
outside = ~grid.within(*block)
matrices, limits = [], []
for b in range(3):
    for a in range(3):
        along, across = (np.outer(y, x).ravel() for y, x in ((values[b], slopes[a]), (slopes[b], values[a])))
        for turn in 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
            weights = np.cos(turn) * along + np.sin(turn) * across
            matrices.append(rows(around[outside], np.tile(weights, (outside.sum(), 1)), n))
            limits.append(grid.costs[outside, b, a])

# On the rim of the block around the goal, a path costs at least its least cost nearby times the distance. All values
# around cells beside the rim are below that, so the surface is.
beside = grid.within(block[0] - 1, block[1] + 1, block[2] - 1, block[3] + 1) & outside
near = grid.within(block[0] - 3, block[1] + 3, block[2] - 3, block[3] + 3)
rim = np.unique(around[beside])
matrices.append(rows(rim[:, None], np.ones((len(rim), 1)), n))
limits.append(np.full(len(rim), grid.costs[near].min() * 1.0 / N))

# As high as possible at the start: the values around its cell, with the weights of its middle.
at_start = grid.pieces_at(START)[0]
goal = np.zeros(n)
goal[around[at_start]] = -np.outer([0.125, 0.75, 0.125], [0.125, 0.75, 0.125]).ravel()
found = linprog(goal, vstack(matrices), np.concatenate(limits), bounds=(-10.0, 10.0), method="highs")

# Divide by the greatest ratio of slope and cost, and let the checker say what is proven.
whole = np.rint(np.ldexp(found.x, EXPONENT))
surface = {"exponent": EXPONENT, "values": "values.npy", "blocks": [], "end": {"cells": block}}
for _ in range(2):
    ARRAYS["values.npy"] = np.diff(whole.astype(np.int64), 2, prepend=[0, 0])
    measured = check_proof.Surface(surface, read, grid, GOAL)
    whole = whole / max(float(measured.steepness.max()), 1.0)
described = {
    "format": check_proof.FORMAT,
    "version": check_proof.VERSION,
    "problem": PROBLEM,
    "path": "path.npy",
    "grids": [{"last": [N, N], "parts": 0, "to_goal": surface}],
    "limit": None,
    "lower": measured.bound(START),
}

file = sys.argv[1] if len(sys.argv) > 1 else io.BytesIO()
with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
    archive.writestr("proof.json", json.dumps(described))
    for name, array in ARRAYS.items():
        held = io.BytesIO()
        np.save(held, array)
        archive.writestr(name, held.getvalue())
result = check_proof.check(file)
print(f"no path costs less than {result['lower']:.4f}; this path costs at most {result['upper']:.4f}")
