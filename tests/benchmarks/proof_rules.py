"""
Print what each rule of proof files brings, and how fast bounds converge: tables of docs/how-it-works/proof-files.md.

``python tests/benchmarks/proof_rules.py`` takes some minutes. Bounds of one map are on the same grids.
"""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any
from unittest.mock import patch

import numpy as np

import cgla_graph as cg
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate import proof_file
from cgla_graph.certificate.subsolution import Level

HILLS = np.add.outer(np.sin(np.arange(10.0)) + 1.0, np.cos(np.arange(12.0)) + 1.0)
RASTER = cg.RiskField(rasters=[cg.RasterRisk(HILLS, (0.0, 0.0, 1.0, 1.0), interpolation="bilinear")])
#: Maps without areas, with areas, and with a raster.
MAPS = {
    "`paper`": cg.load_scenario("paper").problem,
    "`maze`": cg.load_scenario("maze").problem,
    "a bilinear raster": cg.Problem((0.12, 0.2), (0.9, 0.65), RASTER, k=0.5),
}
#: Grids for rates.
GRIDS = 3


def bounds(problem: cg.Problem, cost: float, path: Any, count: int) -> tuple[list[float], list[float]]:  # noqa: ANN401 - an array
    """Return the bound on each of some grids, and the part of the cells of the map that each has."""
    problem = problem.relaxed()
    archive = proof_file.Archive()
    described = proof_file.describe_problem(problem, archive)
    checked = checker.Problem(described, archive.array)
    writer = proof_file._Writer(problem, archive, checked, 1e-3)
    cells, laid = [], checker.Grid.finer

    def finer(grid: checker.Grid, *rest: Any) -> checker.Grid:  # noqa: ANN401 - passed on
        if len(cells) + 1 == count:
            raise StopIteration
        found = laid(grid, *rest)
        cells.append(len(found.columns) / ((found.last[0] + 1) * (found.last[1] + 1)))
        return found

    found: list[float] = []
    bound = checker.Surface.bound

    def noted(surface: checker.Surface, point: Any) -> float:  # noqa: ANN401 - passed on
        found.append(bound(surface, point))
        return found[-1]

    with (
        patch.object(checker.Grid, "finer", finer),
        patch.object(checker.Surface, "bound", noted),
        contextlib.suppress(StopIteration),
    ):
        writer.grids(cost, path)
    each = [max(found[n : n + 2]) for n in range(0, len(found), 2)]
    return list(np.maximum.accumulate(each)), [1.0, *cells]


@contextlib.contextmanager
def without_end_grids() -> Iterator[None]:
    """Leave a cone in each block around an end."""
    original = proof_file._Writer.surface

    def surface(self: Any, sheet: Any, values: Any, height: float, around_end: Any, *rest: Any) -> Any:  # noqa: ANN401 - passed on
        bare = around_end and {"cells": around_end["cells"]}
        return original(self, sheet, values, height, bare, *rest)

    with patch.object(proof_file._Writer, "surface", surface):
        yield


@contextlib.contextmanager
def without_corner_blocks() -> Iterator[None]:
    """Lay no block around a corner."""
    with patch.object(Level, "corners", ()):
        yield


@contextlib.contextmanager
def without_steep_charges() -> Iterator[None]:
    """Divide surfaces by the greatest ratio of slope and cost."""

    def greatest(_: Any, steepness: Any, *__: Any) -> float:  # noqa: ANN401 - a surface, an array
        return max(float(steepness.max(initial=0.0)), 1.0) * proof_file.MORE

    with patch.object(proof_file, "_least_loss", greatest):
        yield


@contextlib.contextmanager
def as_it_is() -> Iterator[None]:
    """Change nothing."""
    yield


RULES: dict[str, Callable[[], contextlib.AbstractContextManager[None]]] = {
    "all rules": as_it_is,
    "cones instead of grids around ends": without_end_grids,
    "no blocks around corners": without_corner_blocks,
    "no charges for steep cells": without_steep_charges,
}


def main() -> None:
    """Print both tables."""
    gaps: dict[str, list[str]] = {name: [] for name in [*RULES, "areas not looked at"]}
    rates = []
    for name, problem in MAPS.items():
        best = cg.solve(problem, "hybrid")
        for rule, way in RULES.items():
            with way():
                found, cells = bounds(problem, best.cost, best.path, GRIDS if rule == "all rules" else 2)
            gaps[rule].append(f"{1.0 - found[min(1, len(found) - 1)] / best.cost:.2%}")
            if rule == "all rules":
                gap = [1.0 - one / best.cost for one in found]
                orders = [f"{math.log2(one / other):.1f}" for one, other in pairwise(gap)]
                rates.append((name, " → ".join(f"{one:.2%}" for one in gap), ", ".join(orders),
                              " → ".join(f"{one:.0%}" for one in cells)))  # fmt: skip
        if problem.no_fly is None:
            gaps["areas not looked at"].append("")
        else:
            bare = replace(problem, no_fly=None, clearance=0.0)
            found, _ = bounds(bare, cg.solve(bare, "hybrid").cost, None, 2)
            gaps["areas not looked at"].append(f"{1.0 - found[-1] / best.cost:.2%}")
    print(f"| gap on the second grid | {' | '.join(MAPS)} |\n|---|{'---|' * len(MAPS)}")
    for rule, some in gaps.items():
        print(f"| {rule} | {' | '.join(some)} |")
    print("\n| map | gaps, grid after grid | orders | cells of the map that are kept |\n|---|---|---|---|")
    for row in rates:
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
