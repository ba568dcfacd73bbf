"""The proof over cells of constant cost: which proof a bound is from, how it ends, and what pictures and files get."""

import json
import math
import pickle
from functools import cache

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate.cell_proof import CellProof
from cgla_graph.certificate.certificate import prove
from cgla_graph.comparisons.study.documents import certificate_document, certificate_from

RNG = np.random.default_rng(1)
VALUES = np.exp(4.0 * (RNG.random((24, 24)) - 0.5))


def noise(k: float = 10.0, interpolation: str = "nearest", **settings: object) -> cg.Problem:
    raster = cg.RasterRisk(VALUES, (0, 0, 24, 24), interpolation=interpolation, origin="lower")  # type: ignore[arg-type]
    ends = (2.53, 2.61), (21.9, 19.6)
    return cg.Problem(*ends, cg.RiskField(rasters=[raster]), k, (0, 0, 24, 24), **settings)  # type: ignore[arg-type]


@cache
def path() -> FloatArray:
    """Return a path that is made when the first test asks, and not when tests are collected."""
    return cg.solve(noise(), "weighted-regions").path


def test_it_closes_the_gap_where_a_spline_cannot() -> None:
    proof = prove(noise(), path(), tolerance=0.001)
    lower = [grid.lower_bound for grid in proof.grids]

    assert (proof.proof, proof.reached) == ("cells", True)
    assert proof.message == "the gap is within the tolerance; proven over cells of constant cost"
    assert 0.999 < proof.lower_bound / noise().evaluate(path()).cost < 1.0
    assert lower == sorted(lower)
    assert lower[-1] == proof.lower_bound
    assert [grid.steps for grid in proof.grids] == sorted({grid.steps for grid in proof.grids})
    assert [grid.cells for grid in proof.grids] == sorted([grid.cells for grid in proof.grids], reverse=True)
    assert proof.grids[0].cells == VALUES.size
    assert (proof.cells, proof.spacing) == (proof.grids[-1].cells, proof.grids[-1].spacing)


def test_the_tube_covers_the_path() -> None:
    proof = prove(noise(), path(), tolerance=0.001)
    last, runs = proof.grids[-1].last, proof.grids[-1].runs
    at = np.floor(path() / 24.0 * np.array(last) + 0.5)
    cells = {(row, column) for row, first, end in runs.tolist() for column in range(first, end)}

    assert {(int(y), int(x)) for x, y in at} <= cells
    assert len(cells) < 0.5 * last[0] * last[1]


def test_the_kind_of_proof_is_told_in_copies_and_files_too() -> None:
    proof = prove(noise(), path(), tolerance=0.01)
    document = json.loads(json.dumps(certificate_document(proof)))

    assert proof.document()["proof"] == "cells"
    assert pickle.loads(pickle.dumps(proof)).proof == "cells"  # noqa: S301 - our own bytes
    assert certificate_from(document).proof == "cells"
    del document["proof"]
    assert certificate_from(document).proof == ""


@pytest.mark.parametrize(
    ("problem", "by"),
    [
        (noise(interpolation="bilinear", k=0.1), "grid"),
        (cg.Problem((0.1, 0.1), (0.9, 0.9)), "line"),
        (cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), 5.0), "grid"),
    ],
)
def test_other_maps_have_other_proofs(problem: cg.Problem, by: str) -> None:
    proof = prove(problem, tolerance=0.05)
    assert proof.proof == by
    assert "cells of constant cost" not in proof.message


def test_without_a_path_it_finds_one() -> None:
    proof = prove(noise(), tolerance=0.01)
    assert proof.reached
    assert proof.upper_bound == pytest.approx(noise().evaluate(path()).cost, rel=1e-3)


def test_against_a_bad_path_a_better_one_is_named() -> None:
    bad = [noise().start, (2.5, 20.0), noise().goal]
    proof = prove(noise(), bad, tolerance=0.01)

    assert proof.message.startswith("no bound comes within the tolerance: a path is known that costs")
    assert proof.upper_bound == noise().evaluate(bad).cost
    assert proof.lower_bound <= noise().evaluate(path()).cost


def test_cells_inside_of_areas_are_closed() -> None:
    """A wall over the whole map but for a gap: the bound has to go through the gap."""
    wall = shapely.union_all([shapely.box(10.2, 3.5, 13.9, 25.0), shapely.box(10.2, -1.0, 13.9, 1.2)])
    problem = noise(k=0.1, no_fly=wall)
    path = cg.solve(problem, "weighted-regions").path
    proof, open_cost = prove(problem, path, tolerance=0.05), cg.solve(noise(k=0.1), "weighted-regions").cost

    assert proof.reached
    assert 1.05 * open_cost < proof.lower_bound <= proof.upper_bound
    first = CellProof.begin(problem, 10**6)
    assert first is not None
    assert first.loose
    assert math.isinf(first.cells.costs[10, 12])


def test_a_map_that_is_closed_has_no_path() -> None:
    proof = prove(noise(no_fly=shapely.box(10.2, -1.0, 13.9, 25.0)))
    assert math.isinf(proof.lower_bound)
    assert proof.message == "there is no path"


def test_where_points_are_too_many_the_limit_is_named() -> None:
    proof = prove(noise(), path(), tolerance=1e-6)
    few = CellProof.begin(noise(), 128**2)

    assert proof.message.startswith("there are 63 points on each side of a cell, and no more are laid; proven over")
    assert proof.gap < 0.001
    assert few is not None
    few.most = 10_000
    assert few.finer(5.0) == "the next points on cells would be 39025 nodes, of 10000 allowed"


def test_it_is_drawn() -> None:
    proof = prove(noise(), path(), tolerance=0.001)
    axes = Figure().subplots(1, 2)
    cg.plot(proof, axes)
    assert axes[1].get_xlabel() == "distance of points, of the map's longer side"


def test_start_and_goal_may_be_one_place() -> None:
    raster = cg.RasterRisk([[1.0, 5.0]], (0, 0, 2, 1), interpolation="nearest")
    problem = cg.Problem((0.5, 1.0), (0.5, 1.0), cg.RiskField(rasters=[raster]), 1.0, (0, 0, 2, 1))
    proof = prove(problem)

    assert (proof.lower_bound, proof.upper_bound, proof.gap) == (0.0, 0.0, 0.0)
    assert cg.solve(problem, "weighted-regions").cost == 0.0
