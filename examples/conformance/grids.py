"""
Planners for `cgla conform` that march over a grid with a library: scikit-fmm, eikonalfm or pykonal.

    pip install numpy numba scikit-fmm eikonalfm pykonal
    cgla conform -- python3 grids.py eikonalfm --side 512

Each solves the eikonal equation `|grad T| = 1 + k F` from the goal; the path is the way of steepest descent of `T` from
the start. It reads a problem as JSON from standard input and writes a path as JSON to standard output.
Docs: docs/conformance.md.
"""

import argparse
import json
import math
import sys
import time

import numba
import numpy as np

#: What a unit of length costs inside an area, and how near to one, in spacings, counts as inside.
WALL, CLEARANCE = 1e4, 1.0
#: Spacings from the goal within which the path is straight.
NEAR = 2.0
#: Nodes along the longer side that `--history` tries.
SIDES = 32, 64, 128, 256, 512, 1024


def eikonalfm(cost, goal, step):
    """Return costs to the goal by eikonalfm, of second order and with the distance to the goal factored out."""
    import eikonalfm as library

    return library.factored_fast_marching(1.0 / cost, goal, (step, step), 2) * library.distance(
        cost.shape, (step, step), goal, indexing="ij"
    )


def scikit_fmm(cost, goal, step):
    """Return costs to the goal by scikit-fmm, of second order, from a small circle around the goal."""
    import skfmm as library

    i, j = np.ogrid[: cost.shape[0], : cost.shape[1]]
    level = np.hypot(i - goal[0], j - goal[1]) - NEAR
    return np.asarray(library.travel_time(level, 1.0 / cost, dx=step, order=2))


def pykonal(cost, goal, step):
    """Return costs to the goal by pykonal."""
    import pykonal as library

    solver = library.EikonalSolver(coord_sys="cartesian")
    solver.velocity.min_coords = 0, 0, 0
    solver.velocity.node_intervals = step, step, 1
    solver.velocity.npts = *cost.shape, 1
    solver.velocity.values = 1.0 / cost[..., None]
    solver.traveltime.values[(*goal, 0)] = 0.0
    solver.unknown[(*goal, 0)] = False
    solver.trial.push(*goal, 0)
    solver.solve()
    return np.asarray(solver.traveltime.values)[..., 0]


LIBRARIES = {"eikonalfm": eikonalfm, "scikit-fmm": scikit_fmm, "pykonal": pykonal}


class Grid:
    """Nodes within the bounds, the goal among them, and what a unit of length costs at each."""

    def __init__(self, problem, side):
        """Lay it."""
        x_min, y_min, x_max, y_max = problem["bounds"]
        self.step = max(x_max - x_min, y_max - y_min) / side
        self.goal = tuple(
            math.floor((at - low) / self.step + 1e-9) for at, low in zip(problem["goal"], (x_min, y_min), strict=True)
        )
        self.low = tuple(at - i * self.step for at, i in zip(problem["goal"], self.goal, strict=True))
        self.x, self.y = (
            low + self.step * np.arange(math.floor((high - low) / self.step + 1e-9) + 1)
            for low, high in zip(self.low, (x_max, y_max), strict=True)
        )
        self.cost = 1.0 + problem["k"] * self.risk(problem)
        self.cost[self.closed(problem["no_fly"])] = WALL * self.cost.max()

    def risk(self, problem):
        """Return the risk per unit length at every node."""
        spared = np.ones((len(self.x), len(self.y)))
        for t in problem["threats"]:
            across, up = (
                np.exp(-((at - t[key]) ** 2) / (2.0 * t["spread"] ** 2)) for at, key in ((self.x, "x"), (self.y, "y"))
            )
            spared *= 1.0 - t["peak"] * across[:, None] * up
        total = 1.0 - spared
        for raster in problem["rasters"]:
            total += self.raster_risk(raster)
        return total

    def raster_risk(self, raster):
        """Return the risk of one raster at every node."""
        x_min, y_min, x_max, y_max = raster["bounds"]
        values = np.array(raster["values"]).T
        within = ((x_min <= self.x) & (self.x <= x_max))[:, None] & ((y_min <= self.y) & (self.y <= y_max))
        u = (self.x - x_min) / (x_max - x_min) * values.shape[0]
        v = (self.y - y_min) / (y_max - y_min) * values.shape[1]
        if raster["interpolation"] == "nearest":
            i, j = (np.clip(at.astype(int), 0, n - 1) for at, n in ((u, values.shape[0]), (v, values.shape[1])))
            return np.where(within, values[np.ix_(i, j)], 0.0)
        u, v = (np.clip(at - 0.5, 0.0, n - 1.0) for at, n in ((u, values.shape[0]), (v, values.shape[1])))
        i, j = u.astype(int), v.astype(int)
        right, above = np.minimum(i + 1, values.shape[0] - 1), np.minimum(j + 1, values.shape[1] - 1)
        a, b = (u - i)[:, None], v - j
        low = values[np.ix_(i, j)] * (1.0 - a) + values[np.ix_(right, j)] * a
        high = values[np.ix_(i, above)] * (1.0 - a) + values[np.ix_(right, above)] * a
        return np.where(within, low * (1.0 - b) + high * b, 0.0)

    def closed(self, polygons):
        """Return which nodes are inside of an area, or nearer to one than the clearance."""
        inside, close = (np.zeros((len(self.x), len(self.y)), dtype=bool) for _ in range(2))
        reach = CLEARANCE * self.step
        edges = [(*ring[i - 1], *ring[i]) for polygon in polygons for ring in polygon for i in range(len(ring))]
        for ax, ay, bx, by in edges:
            rows = slice(*np.searchsorted(self.y, (min(ay, by), max(ay, by))))
            if ay != by:
                inside[:, rows] ^= self.x[:, None] < ax + (self.y[rows] - ay) * (bx - ax) / (by - ay)
            columns = slice(*np.searchsorted(self.x, (min(ax, bx) - reach, max(ax, bx) + reach)))
            rows = slice(*np.searchsorted(self.y, (min(ay, by) - reach, max(ay, by) + reach)))
            dx, dy = self.x[columns, None] - ax, self.y[None, rows] - ay
            along = np.clip((dx * (bx - ax) + dy * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2), 0.0, 1.0)
            close[columns, rows] |= np.hypot(dx - along * (bx - ax), dy - along * (by - ay)) < reach
        return inside | close


# (what is compiled is kept for the program alone: numba finds it again by the name of the module)
@numba.njit(cache=__name__ == "__main__")
def descent(costs, u, v, goal, path):
    """Go down bilinear costs, half a spacing a step, to near the goal; return how many points, or -1."""
    for count in range(path.shape[0]):
        path[count, 0], path[count, 1] = u, v
        if math.hypot(u - goal[0], v - goal[1]) < NEAR + 1.0:
            return count + 1
        i, j = min(max(int(u), 0), costs.shape[0] - 2), min(max(int(v), 0), costs.shape[1] - 2)
        a, b = u - i, v - j
        du = (1.0 - b) * (costs[i + 1, j] - costs[i, j]) + b * (costs[i + 1, j + 1] - costs[i, j + 1])
        dv = (1.0 - a) * (costs[i, j + 1] - costs[i, j]) + a * (costs[i + 1, j + 1] - costs[i + 1, j])
        steep = math.hypot(du, dv)
        if steep == 0.0 or not math.isfinite(steep):
            return -1
        u = min(max(u - 0.5 * du / steep, 0.0), costs.shape[0] - 1.0)
        v = min(max(v - 0.5 * dv / steep, 0.0), costs.shape[1] - 1.0)
    return -1


def plan(problem, library, side):
    """Return the waypoints of the way down; None if it leads nowhere."""
    grid = Grid(problem, side)
    costs = np.ascontiguousarray(library(grid.cost, grid.goal, grid.step), dtype=np.float64)
    u, v = ((at - low) / grid.step for at, low in zip(problem["start"], grid.low, strict=True))
    nodes = np.empty((8 * sum(costs.shape), 2))
    count = descent(costs, u, v, (float(grid.goal[0]), float(grid.goal[1])), nodes)
    if count < 0:
        return None
    return [problem["start"], *(nodes[1:count] * grid.step + grid.low).tolist(), problem["goal"]]


def history(problem, library, seconds):
    """List the path of each side, with the CPU seconds that it took, until a side takes too long."""
    plan({**problem, "start": problem["goal"]}, library, SIDES[0])  # what is loaded and compiled once is not counted
    found = []
    for side in SIDES:
        began = time.process_time()
        path = plan(problem, library, side)
        found.append({"seconds": time.process_time() - began, "path": path, "side": side})
        if 4.0 * found[-1]["seconds"] > seconds:
            break
    return found


def main():
    """Answer one problem."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", choices=LIBRARIES)
    parser.add_argument("--side", type=int, default=512, help="nodes along the longer side of the map")
    parser.add_argument("--history", action="store_true", help="try several sides, and write the path of each")
    parser.add_argument("--seconds", type=float, default=10.0, help="of --history, for the largest side")
    options = parser.parse_args()
    problem, library = json.load(sys.stdin), LIBRARIES[options.library]
    if options.history:
        found = history(problem, library, options.seconds)
        json.dump({"path": found[-1]["path"], "history": found}, sys.stdout)
    else:
        json.dump({"path": plan(problem, library, options.side)}, sys.stdout)


if __name__ == "__main__":
    main()
