"""Proof files that claim more than is true, by class: a path below the claim is known for each."""

import copy
import math
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate import check_proof as checker
from tests.support.proofs import (
    Arrays,
    Described,
    archive_of,
    cheapest,
    parts_of,
    problem_of,
    proof_of,
    put_values,
    surfaces_of,
    values_of,
    within,
)

Draw = np.random.Generator
#: Changes a file; returns paths that may be cheap on a map that it has changed, and None where there is nothing to do.
Change = Callable[[Described, Arrays, Draw, float], list[FloatArray] | None]


def _share(draw: Draw) -> float:
    """Return a number below 1, most often just below."""
    return float(1.0 - 10.0 ** draw.uniform(-1.5, -0.2))


# the map is another one than the surfaces are for


def k_lowered(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    one["problem"]["k"] *= _share(draw)
    return []


def _threats(change: Callable[[FloatArray, Draw], Any]) -> Change:
    def changed(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
        name = one["problem"]["threats"]
        if not len(arrays[name]):
            return None
        arrays[name] = arrays[name].copy()
        found = change(arrays[name], draw)
        arrays[name] = arrays[name] if found is None else found
        return []

    return changed


def _lower_peaks(rows: FloatArray, draw: Draw) -> None:
    rows[draw.integers(len(rows)), 3] *= _share(draw)


def _narrower(rows: FloatArray, draw: Draw) -> None:
    rows[draw.integers(len(rows)), 2] *= _share(draw)


def _moved(rows: FloatArray, draw: Draw) -> None:
    rows[draw.integers(len(rows)), :2] += draw.normal(size=2) * 10.0 ** draw.uniform(-2.0, -0.5)


def _without_one(rows: FloatArray, draw: Draw) -> FloatArray:
    return np.delete(rows, draw.integers(len(rows)), axis=0)


def _relaid(one: Described, arrays: Arrays, before: tuple[Described, Arrays], draw: Draw, cells: int = 0) -> None:
    """Fit the first grid of a file to its new areas or bounds: each control value is the one nearest before."""
    from scipy.spatial import KDTree  # noqa: PLC0415 - beside its only use

    old, grids = before[0]["grids"][0], laid_grids(*before)
    new = one["grids"][0] = {"last": [side + cells for side in old["last"]], "parts": old["parts"]}
    one["grids"] = one["grids"][:1]
    problem = checker.Problem(one["problem"], archive_of(arrays).array)
    laid = places_of(checker.Grid.over(problem, new["last"], new["parts"], [0, 1 << 40, 0, 1 << 40]))
    for name in ("to_goal", "to_start"):
        surface = copy.deepcopy(old[name]) | {"blocks": [], "values": f"new-{name}.npy"}
        block = surface["end"]
        block["cells"] = [cell + cells for cell in block["cells"]]
        if cells:
            del block["inside"]
        known = places_of(grids[old[name]["values"]])
        # (along an area, one of the values of both sides)
        _, nearest = KDTree(known + 1e-9 * draw.normal(size=known.shape)).query(laid)
        values = values_of(old[name], arrays)[nearest]
        put_values(surface, arrays, values)
        new[name] = surface


def area_lowered(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rings"]:
        return None
    before = copy.deepcopy(one), dict(arrays)
    name, by = one["problem"]["rings"][0], draw.uniform(0.03, 0.3)
    arrays[name] = arrays[name] - np.array([0.0, by])
    _relaid(one, arrays, before, draw)
    start, goal, top = one["problem"]["start"], one["problem"]["goal"], arrays[name][:, 1].max()
    west, east = arrays[name][:, 0].min(), arrays[name][:, 0].max()
    return [np.array([start, (west, top), (east, top), goal])]


def area_with_a_gap(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rings"]:
        return None
    before = copy.deepcopy(one), dict(arrays)
    name, low = one["problem"]["rings"][0], draw.uniform(0.1, 0.5)
    (west, south), (east, north) = arrays[name].min(axis=0), arrays[name].max(axis=0)
    high = low + 10.0 ** draw.uniform(-3.0, -1.5)
    for ring, (bottom, top) in (("low", (south, low)), ("high", (high, north))):
        arrays[f"{ring}.npy"] = np.array([(west, bottom), (east, bottom), (east, top), (west, top)])
    one["problem"]["rings"] = ["low.npy", "high.npy"]
    _relaid(one, arrays, before, draw)
    middle = 0.5 * (low + high)
    return [np.array([one["problem"]["start"], (west, middle), (east, middle), one["problem"]["goal"]])]


def area_removed(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rings"]:
        return None
    before = copy.deepcopy(one), dict(arrays)
    one["problem"]["rings"] = []
    _relaid(one, arrays, before, draw)
    return [np.array([one["problem"]["start"], one["problem"]["goal"]])]


def area_slanted(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rings"]:
        return None
    before = copy.deepcopy(one), dict(arrays)
    name, (left, right) = one["problem"]["rings"][0], draw.uniform(0.0, 0.4, 2)
    (west, south), (east, north) = arrays[name].min(axis=0), arrays[name].max(axis=0)
    top = [(west, north - left), (east, north - right)]
    arrays[name] = np.array([(west, south), (east, south), *top[::-1]])
    _relaid(one, arrays, before, draw)
    return [np.array([one["problem"]["start"], *top, one["problem"]["goal"]])]


def end_moved(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    start, goal = one["problem"]["start"], one["problem"]["goal"]
    name, other = (("start", goal), ("goal", start))[draw.integers(2)]
    path = arrays[one["path"]]
    far = draw.uniform(0.02, 0.3)
    toward = path[1] if name == "start" else path[-2]
    here = np.array(one["problem"][name])
    step = toward - here
    here = here + step * min(far / math.hypot(*step), 0.9)
    # the surface to the other end is the same as before
    other_way, grids = ("to_start", "to_goal")[name == "goal"], one.get("grids") or one["cells"]["levels"]
    for grid in grids:
        grid.pop(other_way, None)
    del grids[1:]
    one["problem"][name] = here.tolist()
    path = path.copy()
    path[0 if name == "start" else -1] = here
    arrays[one["path"]] = path
    return [path, np.array([here, other])]


def raster_lowered(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rasters"]:
        return None
    name = one["problem"]["rasters"][0]["values"]
    values, share = arrays[name].copy(), _share(draw)
    if draw.random() < 0.5:
        values *= share
    else:
        values[draw.random(values.shape) < 0.3] *= 0.5 * share
    arrays[name] = values
    return []


def raster_moved(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    if not one["problem"]["rasters"]:
        return None
    raster, by = one["problem"]["rasters"][0], draw.normal(size=2) * 10.0 ** draw.uniform(-2.0, -0.8)
    raster["bounds"] = [bound + by[n % 2] for n, bound in enumerate(raster["bounds"])]
    return []


def bounds_moved(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Let paths go around the southern end of a wall: cells are added on two sides of the map."""
    if not one["problem"]["rings"]:
        return None
    before, (x_min, y_min, x_max, y_max) = (copy.deepcopy(one), dict(arrays)), one["problem"]["bounds"]
    columns, rows = one["grids"][0]["last"]
    cells = int(draw.integers(26, 60))
    wide, high = cells * (x_max - x_min) / columns, cells * (y_max - y_min) / rows
    one["problem"]["bounds"] = [x_min - wide, y_min - high, x_max, y_max]
    _relaid(one, arrays, before, draw, cells)
    return [np.array([one["problem"]["start"], (0.45, -0.2), (0.55, -0.2), one["problem"]["goal"]])]


# the surfaces are higher than the cost allows


def claim_raised(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    return []


def all_scaled(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    for surface in surfaces_of(one):
        put_values(surface, arrays, values_of(surface, arrays) * (1.0 + 1.01 * more))
    return []


def one_scaled(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Scale the surfaces of one grid, or those to one end."""
    grids = one["grids"] if "grids" in one else one["cells"]["levels"]
    some = grids[int(draw.integers(len(grids)))]
    for name in ("to_goal", "to_start"):
        if name in some and draw.random() < 0.7:
            for surface in within(some[name]):
                put_values(surface, arrays, values_of(surface, arrays) * (1.0 + 1.05 * more))
    return []


def outer_raised(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Raise what is outside of blocks around ends, where the surfaces inside are not asked."""
    by = 1.05 * more * one["lower"]
    for surface in surfaces_of(one, inner=False):
        put_values(surface, arrays, values_of(surface, arrays) + by)
    return []


def nested_raised(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Raise all surfaces by the same amount, down to those of random depth."""
    if "grids" not in one:
        return None
    by, depth = 1.05 * more * one["lower"], int(draw.integers(1, 4))
    for surface in surfaces_of(one, inner=False):
        inside: Any = surface
        for _ in range(depth):
            put_values(inside, arrays, values_of(inside, arrays) + by)
            if "inside" not in inside.get("end", {}):
                break
            inside = inside["end"]["inside"]["surface"]
    return []


def laid_grids(one: Described, arrays: Arrays) -> dict[str, checker.Grid]:
    """Return the grids that the checker lays, by the name of the values on them."""
    found: dict[str, checker.Grid] = {}

    class Recorded(checker.Surface):
        def __init__(self, described: dict[str, Any], array: Any, grid: checker.Grid, *rest: Any, **more: Any) -> None:  # noqa: ANN401 - passed on
            found[described["values"]] = grid
            super().__init__(described, array, grid, *rest, **more)

    original = checker.Surface
    try:
        checker.Surface = Recorded  # type: ignore[misc]
        with suppress(checker.Refused):
            checker.proven(one, archive_of(arrays).array)
    finally:
        checker.Surface = original  # type: ignore[misc]
    return found


def places_of(grid: checker.Grid) -> FloatArray:
    """Return the place of each control value of a grid, shape (n, 2)."""
    number = grid.controls.reshape(-1)
    across, along = np.tile([-1, 0, 1], 3), np.repeat([-1, 0, 1], 3)
    nodes = np.column_stack([(grid.columns[:, None] + across).ravel(), (grid.rows[:, None] + along).ravel()])
    found = np.zeros((int(number.max()) + 1, 2))
    low, high = (np.array(grid.problem.bounds[end : end + 2]) for end in (0, 2))
    found[number] = low + nodes * (high - low) / np.array(grid.last)
    return found


def start_raised(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Raise a hill of random width around the end that the bound is read at, on all grids."""
    if "grids" not in one:
        return None
    wide, by, grids = 10.0 ** draw.uniform(-1.5, 0.0), 1.1 * more * one["lower"], laid_grids(one, arrays)
    for grid in one["grids"]:
        for name, other in (("to_goal", "start"), ("to_start", "goal")):
            if name in grid:
                far = np.hypot(*(places_of(grids[grid[name]["values"]]) - one["problem"][other]).T)
                hill = by * np.exp(-((far / wide) ** 2))
                put_values(grid[name], arrays, values_of(grid[name], arrays) + hill)
    return []


def cells_dropped(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Raise a ridge between the ends on the first grid, so that no cell there is kept."""
    if "grids" not in one:
        return None
    if len(one["grids"]) < 2:
        return None
    grids, first = laid_grids(one, arrays), one["grids"][0]
    start, goal = np.array(one["problem"]["start"]), np.array(one["problem"]["goal"])
    at, wide = start + draw.uniform(0.2, 0.8) * (goal - start), 10.0 ** draw.uniform(-1.5, -0.5)
    for name in ("to_goal", "to_start"):
        along = (places_of(grids[first[name]["values"]]) - at) @ (goal - start)
        put_values(
            first[name], arrays,
            values_of(first[name], arrays) + 1.5 * more * one["lower"] * np.exp(-((along / wide) ** 2)),
        )  # fmt: skip
    if draw.random() < 0.8:
        # (a grid on which no way leads from start to goal needs no surface)
        one["grids"] = [first, {"parts": one["grids"][1]["parts"]}]
    return []


def block_widened(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Widen a block around an end, with a step of the surface across it."""
    if "grids" not in one:
        return None
    grids, by = laid_grids(one, arrays), 1.1 * more * one["lower"]
    for surface in surfaces_of(one, inner=False):
        wider = int(draw.integers(0, 4))
        cells = surface["end"]["cells"]
        laid = grids[surface["values"]]
        surface["end"]["cells"] = [c + wider * (1 if n % 2 else -1) for n, c in enumerate(cells)]
        low, high = (np.array(laid.problem.bounds[end : end + 2]) for end in (0, 2))
        node = (places_of(laid) - low) / (high - low) * np.array(laid.last)
        west, east, south, north = cells
        inside = (node[:, 0] >= west) & (node[:, 0] < east) & (node[:, 1] >= south) & (node[:, 1] < north)
        put_values(surface, arrays, values_of(surface, arrays) + by * ~inside)
    return []


def box_shrunk(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Shrink boxes around ends, whose surfaces are raised as well."""
    if "grids" not in one:
        return None
    for surface in surfaces_of(one, inner=False):
        by = int(draw.integers(1, 10))
        box = surface["end"]["inside"]["box"]
        surface["end"]["inside"]["box"] = [c + by * (-1 if n % 2 else 1) for n, c in enumerate(box)]
        put_values(surface, arrays, values_of(surface, arrays) + 1.1 * more * one["lower"])
    return []


def charges_avoided(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Remove blocks around corners, or the surfaces inside of those around ends, and claim what there was before."""
    if "grids" not in one:
        return None
    for surface in surfaces_of(one, inner=False):
        surface["blocks"] = []
        if draw.random() < 0.5:
            surface["end"].pop("inside", None)
        put_values(surface, arrays, values_of(surface, arrays) + 1.1 * more * one["lower"])
    return []


def wall_across(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Lay a block from border to border with a step in it, and a surface inside that is as high as it may be."""
    if "grids" not in one:
        return None
    grids, by = laid_grids(one, arrays), 1.1 * more * one["lower"]
    for grid in one["grids"]:
        for name in ("to_goal", "to_start"):
            if name not in grid:
                continue
            surface, laid = grid[name], grids[grid[name]["values"]]
            finer = int(draw.choice([3, 5]))
            column = int(laid.last[0] * draw.uniform(0.4, 0.6))
            cells = [column, column + 2, -1, laid.last[1] + 2]
            box = [finer * column - 2 * finer, finer * column + 4 * finer, -(1 << 40), 1 << 40]
            block_laid = laid.inside_block(finer, 0, box)
            height = draw.uniform(0.0, 1.0) * by
            places = places_of(block_laid)
            low, high = laid.problem.bounds[0], laid.problem.bounds[2]
            middle = low + (column + 0.5) * (high - low) / laid.last[0]
            sign = 1.0 if name == "to_start" else -1.0
            psi = {"exponent": surface["exponent"], "values": f"psi-{surface['values']}", "blocks": []}
            put_values(psi, arrays, height * (sign * (places[:, 0] - middle) > 0.0))
            inside = {"finer": finer, "parts": 0, "box": box, "surface": psi}
            surface["blocks"] = [{"cells": cells, "inside": inside}]
            step = by * (sign * (places_of(laid)[:, 0] - middle) > 0.0)
            put_values(surface, arrays, values_of(surface, arrays) + step)
    return []


def swapped(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Exchange surfaces, or leave out grids before others."""
    grids, kind = one.get("grids") or one["cells"]["levels"], int(draw.integers(3))
    if kind == 0:
        for grid in grids:
            grid["to_goal"], grid["to_start"] = grid.get("to_start", grid["to_goal"]), grid.get("to_goal", {})
    elif kind == 1:
        grids.reverse()
    else:
        del grids[:-1]
    return []


def exponents_changed(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Double some surfaces, by their exponents."""
    some = list(surfaces_of(one))
    for surface in some:
        if draw.random() < 0.5:
            surface["exponent"] -= 1
    some[0]["exponent"] -= 1
    return []


def rounded_up(one: Described, arrays: Arrays, draw: Draw, more: float) -> list[FloatArray] | None:
    """Round so coarsely that a surface is higher at its begin by what is claimed too much."""
    by = 1.1 * more * one["lower"]
    exponent = -math.ceil(math.log2(by)) + int(draw.integers(0, 3))
    for surface in surfaces_of(one, inner=False):
        values = values_of(surface, arrays)
        put_values(surface, arrays, np.ceil(np.ldexp(values, exponent)) * 2.0**-exponent, exponent)
    return []


#: What is changed, by class: on the map, and of the surfaces.
ON_MAPS: dict[str, Change] = {
    "k lowered": k_lowered,
    "a peak lowered": _threats(_lower_peaks),
    "a threat narrower": _threats(_narrower),
    "a threat moved": _threats(_moved),
    "a threat removed": _threats(_without_one),
    "an area lowered": area_lowered,
    "an area with a gap": area_with_a_gap,
    "an area slanted": area_slanted,
    "an area removed": area_removed,
    "an end moved": end_moved,
    "values of a raster lowered": raster_lowered,
    "a raster moved": raster_moved,
    "bounds moved": bounds_moved,
}
OF_SURFACES: dict[str, Change] = {
    "the claim raised": claim_raised,
    "all surfaces scaled": all_scaled,
    "some surfaces scaled": one_scaled,
    "raised outside of blocks": outer_raised,
    "raised down to a depth": nested_raised,
    "a hill at the begin": start_raised,
    "cells dropped": cells_dropped,
    "blocks with a step": block_widened,
    "boxes shrunk": box_shrunk,
    "charges avoided": charges_avoided,
    "a block across the map": wall_across,
    "surfaces exchanged": swapped,
    "exponents changed": exponents_changed,
    "coarse rounding": rounded_up,
}


@cache
def best_of(problem: cg.Problem, tolerance: float) -> tuple[float, FloatArray | None]:
    """Return the least cost that is known on the map of a proof file, and its path."""
    described, arrays = parts_of(proof_of(problem, tolerance))
    return cheapest(problem_of(described, arrays), [arrays[described["path"]]])


def mutant(problem: cg.Problem, tolerance: float, change: Change, draw: Draw) -> tuple[Described, Arrays, float] | None:
    """
    Return a file that claims more than the cost of a path, and that cost; None if the change made no such file.

    Where a map was changed, the claim is one that the surfaces would bear out on the map before.
    """
    described, arrays = parts_of(proof_of(problem, tolerance))
    described, lower = copy.deepcopy(described), described["lower"]
    cost, path = best_of(problem, tolerance)
    above = 10.0 ** draw.uniform(-6.0, -2.0)
    if change is not cells_dropped and draw.random() < 0.7:
        # (a finer grid has other cells if the one before drops others: such a file is refused at once)
        del described.get("grids", [])[1:]
    paths = change(described, arrays, draw, cost * (1.0 + above) / lower - 1.0)
    if paths is None:
        return None
    on_map = change in ON_MAPS.values()
    if on_map:
        cost, path = cheapest(problem_of(described, arrays), [*paths, arrays[described["path"]]])
    if path is None or (on_map and not cost * (1.0 + 1e-9) < lower):
        return None
    claim = min(lower, cost * (1.0 + above)) if on_map else cost * (1.0 + above)
    described["lower"] = claim
    limited = described if "limit" in described else described["cells"]
    limited["limit"] = max(claim, limited["limit"])
    if on_map:
        arrays[described["path"]] = path
    return described, arrays, cost
