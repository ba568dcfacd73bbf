"""
A planner for `cgla conform`, in Python's standard library alone: A* on a lattice of eight directions.

    cgla conform -- python3 astar.py

It reads a problem as JSON from standard input and writes a path as JSON to standard output. Docs: docs/conformance.md.
"""

import heapq
import itertools
import json
import math
import sys

#: Points along the longer side of the map.
POINTS = 81
#: Closer to an edge than this part of the longer side counts as crossing it: the oracle has no tolerance.
NEAR = 1e-9


class Map:
    """A problem: what a path costs, and where it may not go."""

    def __init__(self, problem):
        """Keep what is asked again and again."""
        self.x_min, self.y_min, self.x_max, self.y_max = problem["bounds"]
        self.side = max(self.x_max - self.x_min, self.y_max - self.y_min)
        self.k, self.threats, self.rasters = problem["k"], problem["threats"], problem["rasters"]
        # each edge of each ring; holes are rings like any other: what is inside of an odd number of them is closed
        self.edges = [
            (*ring[i - 1], *ring[i]) for polygon in problem["no_fly"] for ring in polygon for i in range(len(ring))
        ]

    def risk(self, x, y):
        """Return the risk per unit length at a place."""
        spared = 1.0
        for t in self.threats:
            squared = (x - t["x"]) ** 2 + (y - t["y"]) ** 2
            spared *= 1.0 - t["peak"] * math.exp(-squared / (2.0 * t["spread"] ** 2))
        return 1.0 - spared + sum(raster_risk(raster, x, y) for raster in self.rasters)

    def cost(self, x1, y1, x2, y2):
        """Return length + k * risk of a segment, by Simpson's rule: good enough to search with."""
        ends = self.risk(x1, y1) + self.risk(x2, y2)
        middle = self.risk(0.5 * (x1 + x2), 0.5 * (y1 + y2))
        return math.hypot(x2 - x1, y2 - y1) * (1.0 + self.k * (ends + 4.0 * middle) / 6.0)

    def crosses(self, x1, y1, x2, y2):
        """Tell whether a segment meets a no-fly area: cut it at all edges, and look at the middle of each part."""
        cuts = [0.0, 1.0]
        for ax, ay, bx, by in self.edges:
            if max(ax, bx) < min(x1, x2) or max(x1, x2) < min(ax, bx):
                continue
            if max(ay, by) < min(y1, y2) or max(y1, y2) < min(ay, by):
                continue
            turn = (x2 - x1) * (by - ay) - (y2 - y1) * (bx - ax)
            if turn != 0.0:
                along = ((ax - x1) * (by - ay) - (ay - y1) * (bx - ax)) / turn
                across = ((ax - x1) * (y2 - y1) - (ay - y1) * (x2 - x1)) / turn
                if 0.0 < along < 1.0 and -NEAR <= across <= 1.0 + NEAR:
                    cuts.append(along)
        cuts.sort()
        for first, last in itertools.pairwise(cuts):
            part = 0.5 * (first + last)
            if self.is_closed(x1 + part * (x2 - x1), y1 + part * (y2 - y1)):
                return True
        return False

    def is_closed(self, x, y):
        """Tell whether a place is inside a no-fly area, or almost on its edge."""
        inside = False
        for ax, ay, bx, by in self.edges:
            squared = (bx - ax) ** 2 + (by - ay) ** 2
            along = min(1.0, max(0.0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / squared))
            if math.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay)) < NEAR * self.side:
                return True
            if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
                inside = not inside
        return inside


def raster_risk(raster, x, y):
    """Return the risk of one raster at a place; rows begin at y_min."""
    x_min, y_min, x_max, y_max = raster["bounds"]
    values = raster["values"]
    rows, columns = len(values), len(values[0])
    if not (x_min <= x <= x_max and y_min <= y <= y_max):
        return 0.0
    u, v = (x - x_min) / (x_max - x_min) * columns, (y - y_min) / (y_max - y_min) * rows
    if raster["interpolation"] == "nearest":
        return values[min(int(v), rows - 1)][min(int(u), columns - 1)]
    u, v = min(max(u - 0.5, 0.0), columns - 1.0), min(max(v - 0.5, 0.0), rows - 1.0)
    i, j = min(int(u), max(columns - 2, 0)), min(int(v), max(rows - 2, 0))
    right, up = min(i + 1, columns - 1), min(j + 1, rows - 1)
    a, b = u - i, v - j
    low = values[j][i] * (1.0 - a) + values[j][right] * a
    high = values[up][i] * (1.0 - a) + values[up][right] * a
    return low * (1.0 - b) + high * b


class Lattice:
    """Points through the start, within the bounds, and the goal."""

    def __init__(self, where, start, goal):
        """Lay it."""
        self.start, self.goal, self.step = start, goal, where.side / (POINTS - 1)
        self.low = math.ceil((where.x_min - start[0]) / self.step), math.ceil((where.y_min - start[1]) / self.step)
        self.high = math.floor((where.x_max - start[0]) / self.step), math.floor((where.y_max - start[1]) / self.step)

    def place(self, node):
        """Return where a node is."""
        if node == "goal":
            return self.goal
        return self.start[0] + node[0] * self.step, self.start[1] + node[1] * self.step

    def neighbours(self, node):
        """List the nodes beside one."""
        for i in (-1, 0, 1):
            for j in (-1, 0, 1):
                other = node[0] + i, node[1] + j
                if other != node and all(
                    low <= one <= high for low, one, high in zip(self.low, other, self.high, strict=True)
                ):
                    yield other
        if math.dist(self.place(node), self.goal) <= 1.5 * self.step:
            yield "goal"


def plan(problem):
    """Return the waypoints of the best path on the lattice; None if there is none."""
    where, goal = Map(problem), tuple(problem["goal"])
    lattice = Lattice(where, tuple(problem["start"]), goal)
    best, came, done = {(0, 0): 0.0}, {}, set()
    # no path costs less than its length; the order, as "goal" and a pair do not compare
    order = itertools.count()
    queue = [(math.dist(lattice.start, goal), next(order), (0, 0))]
    while queue:
        _, _, node = heapq.heappop(queue)
        if node == "goal":
            return way_to(node, came, lattice)
        if node in done:
            continue
        done.add(node)
        here = lattice.place(node)
        for other in lattice.neighbours(node):
            there = lattice.place(other)
            if other in done or where.crosses(*here, *there):
                continue
            cost = best[node] + where.cost(*here, *there)
            if cost < best.get(other, math.inf):
                best[other], came[other] = cost, node
                heapq.heappush(queue, (cost + math.dist(there, goal), next(order), other))
    return None


def way_to(node, came, lattice):
    """Return the places on the way to a node."""
    way = [node]
    while way[-1] in came:
        way.append(came[way[-1]])
    return [lattice.place(one) for one in reversed(way)]


if __name__ == "__main__":
    json.dump({"path": plan(json.load(sys.stdin))}, sys.stdout)
