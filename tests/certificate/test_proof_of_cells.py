"""Proof files over cells of constant cost: close bounds, no false one, and lines on which costs are lesser."""

import io
import itertools
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from proofs import packed_and_checked, parts_of
from strategies import examples

import cgla_graph as cg
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate import proof_of_cells
from cgla_graph.certificate.certificate import prove
from cgla_graph.certificate.proof_file import Archive, describe_problem
from cgla_graph.certificate.proof_of_cells import beside_lines

RNG = np.random.default_rng(1)
VALUES = np.exp(4.0 * (RNG.random((12, 12)) - 0.5))


def raster(values: Any, box: tuple[float, ...] = (0, 0, 12, 12)) -> cg.RasterRisk:  # noqa: ANN401 - numbers
    return cg.RasterRisk(values, box, interpolation="nearest", origin="lower")  # type: ignore[arg-type]


def noise(start: tuple[float, float] = (1.53, 2.61), no_fly: shapely.Geometry | None = None) -> cg.Problem:
    return cg.Problem(start, (10.9, 8.6), cg.RiskField(rasters=[raster(VALUES)]), 10.0, (0, 0, 12, 12), no_fly=no_fly)


#: Both rasters have the lesser value on their common lines: paths along them cost less than in the cells beside.
SHARED = cg.Problem(
    (0.9, 0.5),
    (3.1, 3.5),
    cg.RiskField(rasters=[raster(of, (0, 0, 4, 4)) for of in ([[0, 9, 0, 9]] * 4, [[9, 0, 9, 0]] * 4)]),
    10.0,
    (0, 0, 4, 4),
)
#: It closes whole cells: all but the lowest two rows of three columns.
WALL = shapely.box(4.8, 1.8, 8.2, 13.0)


@cache
def proof_of(problem: cg.Problem, tolerance: float = 0.01) -> tuple[bytes, float, cg.Solution]:
    """Return a file, its bound, and the path."""
    import tempfile  # noqa: PLC0415 - beside its only use

    best = cg.solve(problem, "weighted-regions")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "one.proof"
        found = cg.save_proof(problem, file, best.path, tolerance=tolerance)
        return file.read_bytes(), found["lower"], best


@pytest.mark.parametrize("problem", [noise(), noise((3.0, 2.61)), noise((3.0, 4.0)), noise((0.0, 0.0))])
def test_a_file_is_as_close_as_the_proof(problem: cg.Problem) -> None:
    """Also where the start is on a line or a corner."""
    data, lower, best = proof_of(problem)
    found, solver = checker.check(io.BytesIO(data)), prove(problem, best.path, tolerance=0.01)
    assert "cells" in parts_of(data)[0]
    assert (found["lower"], solver.proof) == (lower, "cells")
    assert 0.0 < best.cost / lower - 1.0 <= max(1.3 * solver.gap, 0.01)
    assert best.cost * (1.0 - 1e-12) <= found["upper"] <= best.cost * (1.0 + 1e-9)


def test_paths_along_lines_that_are_no_floats_are_on_their_cheaper_side() -> None:
    """The line is at 0.3 but for rounding, and the float beside it may be in the dear cell."""
    values = np.full((10, 10), 9.0)
    values[:, [3, 6]] = 0.0
    before = []
    for column, line in ((3, 0.3), (3, 0.4), (6, 0.6), (6, 0.7)):
        problem = cg.Problem((line, 0.05), (line, 0.95), cg.RiskField(rasters=[raster(values, (0, 0, 1, 1))]), 10.0)
        archive = Archive()
        checked_problem = checker.Problem(describe_problem(problem, archive), archive.array)
        for path in ([(line, 0.05), (line, 0.95)], [(line, 0.05), (line, 0.4), (line, 0.95)]):
            moved = beside_lines(np.array(path), checked_problem)
            before.append(checker.upper_bound(checked_problem, np.array(path)))
            assert checker.upper_bound(checked_problem, moved) == pytest.approx(0.9, rel=1e-12), column
            assert np.abs(moved[:, 0] - line).max() < 1e-15
    assert max(before) > 80.0


def test_areas_close_cells() -> None:
    """The bound has to go around a wall; without it, it is refused."""
    data, lower, best = proof_of(noise(no_fly=WALL), 0.5)
    described, arrays = parts_of(data)
    assert 1.05 * proof_of(noise())[2].cost < lower <= best.cost
    described["problem"]["rings"] = []
    with pytest.raises(checker.Refused, match="more or fewer values"):
        packed_and_checked(described, arrays)


def test_no_path(tmp_path: Path) -> None:
    shut = noise(no_fly=shapely.box(4.8, -1.0, 6.2, 13.0))
    assert cg.save_proof(shut, tmp_path / "shut.proof")["lower"] == math.inf
    described, arrays = parts_of((tmp_path / "shut.proof").read_bytes())
    arrays[described["problem"]["rings"][0]] = np.array([(4.8, -1.0), (6.2, -1.0), (6.2, 11.99), (4.8, 11.99)])
    with pytest.raises(checker.Refused, match="which is less than inf"):
        packed_and_checked(described, arrays)


def test_lines_of_several_rasters_cost_less() -> None:
    """Both cells cost 91; along the line, the path costs 1 a unit of length."""
    data, lower, _ = proof_of(SHARED)
    described, arrays = parts_of(data)
    path = np.array([(0.9, 0.5), (1.0, 0.5), (1.0, 3.5), (3.0, 3.5), (3.1, 3.5)])
    archive = Archive()
    archive.arrays = arrays
    problem = checker.Problem(described["problem"], archive.array)
    assert lower <= checker.upper_bound(problem, path)
    assert lower < 0.65 * math.dist(SHARED.start, SHARED.goal) * 91.0
    # (a proof that takes the cells alone is refused: its file is that of one raster of their sum)
    summed = cg.Problem(
        SHARED.start, SHARED.goal, cg.RiskField(rasters=[raster([[9] * 4] * 4, (0, 0, 4, 4))]), 10.0, (0, 0, 4, 4)
    )
    other, held = parts_of(proof_of(summed)[0])
    for name in described["problem"]["rasters"]:
        held[name["values"] + "x"] = arrays[name["values"]]
        other["problem"].setdefault("more", []).append({**name, "values": name["values"] + "x"})
    other["problem"]["rasters"] = other["problem"].pop("more")
    with pytest.raises(checker.Refused):
        packed_and_checked(other, held)


@pytest.mark.parametrize("beside", [0.0, 1e-16, -1e-12, 3e-10, -3e-10])
@pytest.mark.parametrize(("axis", "far"), [(0, False), (0, True), (1, False), (1, True)])
def test_on_the_border_the_cells_beyond_count(tmp_path: Path, beside: float, axis: int, far: bool) -> None:
    """The map is a window of a raster with cheaper cells beyond its border: `evaluate` takes those near a line."""
    values = np.full((5, 5), 9.0)
    values[:, 4 if far else 0] = 0.0
    window = raster(values if axis == 0 else values.T, (-1, -1, 4, 4))
    line, near = (3.0 + beside, 2.9) if far else (0.0 + beside, 0.1)
    path = np.array([(near, 0.5), (line, 0.5), (line, 2.5), (near, 2.5)])
    box = (0.0, 0.0, line, 3.0) if far else (line, 0.0, 3.0, 3.0)
    if axis == 1:
        path, box = path[:, ::-1], (box[1], box[0], box[3], box[2])
    problem = cg.Problem(tuple(path[0]), tuple(path[3]), cg.RiskField(rasters=[window]), 10.0, box)
    lower = cg.save_proof(problem, tmp_path / "one.proof", path, tolerance=0.02)["lower"]
    assert lower <= problem.evaluate(path).cost
    # (farther off than rounding, a line that is none counts as one)
    assert lower > 0.9 * problem.evaluate(path).cost or abs(beside) > 1e-15


def test_a_line_beside_an_outline_costs_as_little_as_the_cell_inside(tmp_path: Path) -> None:
    values = np.full((10, 10), 9.0)
    values[1:-1, 3] = 0.0
    area = shapely.box(0.3, 0.01, 0.45, 0.99)
    field = cg.RiskField(rasters=[raster(values, (0, 0, 1, 1))])
    problem = cg.Problem((0.25, 0.15), (0.25, 0.85), field, 100.0, no_fly=area)
    path = np.array([(0.25, 0.15), (0.3, 0.15), (0.3, 0.85), (0.25, 0.85)])
    lower = cg.save_proof(problem, tmp_path / "one.proof", path, tolerance=0.1)["lower"]
    assert 0.9 * problem.evaluate(path).cost < lower <= problem.evaluate(path).cost


# one cell, by hand


def on_border(t: Any) -> list[Any]:  # noqa: ANN401 - arrays
    """Return places on the lower, upper, left and right side of a cell of size 2."""
    low, high = np.zeros_like(t), np.full_like(t, 2.0)
    return [np.column_stack(one) for one in ((t, low), (t, high), (low, t), (high, t))]


def single(heights: Any, parts: list[float], lower: float) -> tuple[dict[str, Any], dict[str, Any]]:  # noqa: ANN401 - a function
    """Describe a proof on a map of one cell of cost 3, from its lower left corner to the upper right one."""
    archive, inner = Archive(), np.array(parts)
    below, above, left, right = on_border(inner)
    places = np.concatenate([[(0, 0)], below, [(2, 0)], left, right, [(0, 2)], above, [(2, 2)]])
    whole = np.rint(np.ldexp(heights(places), 20)).astype(np.int64)
    lines = archive.add(np.array([(0.0, 0.0), (2.0, 2.0)]), "lines")
    bounds = [0.0, 0.0, 2.0, 2.0]
    values = archive.add(np.array([[2.0]]), "raster")
    problem = {
        "start": [0.0, 0.0],
        "goal": [2.0, 2.0],
        "bounds": bounds,
        "k": 1.0,
        "threats": archive.add(np.empty((0, 4)), "threats"),
        "rasters": [{"values": values, "bounds": bounds, "interpolation": "nearest"}],
        "rings": [],
        "on_earth": False,
    }
    to_goal = {"exponent": 20, "values": archive.add(np.diff(whole, prepend=0), "values")}
    cells = {"x": lines, "y": lines, "limit": None}
    cells["levels"] = [{"parts": archive.add(inner / 2.0, "parts"), "to_goal": to_goal}]
    described = {"format": checker.FORMAT, "version": checker.VERSION, "problem": problem, "cells": cells}
    return described | {"lower": lower}, archive.arrays


def test_a_proof_by_hand() -> None:
    """A plane wave along the diagonal, a little less steep than the cost."""

    def wave(at: Any) -> Any:  # noqa: ANN401 - arrays
        return 2.99 / math.sqrt(2.0) * (4.0 - at.sum(axis=1))

    assert packed_and_checked(*single(wave, [0.5, 1.0, 1.5], 2.98 * math.sqrt(8.0)))["lower"] == 2.98 * math.sqrt(8.0)
    with pytest.raises(checker.Refused, match=r"cell \(0, 0\): values fall faster than the cost"):
        packed_and_checked(*single(lambda at: 1.004 * wave(at), [0.5, 1.0, 1.5], 8.4))
    with pytest.raises(checker.Refused, match="which is less than"):
        packed_and_checked(*single(wave, [], 2.9901 * math.sqrt(8.0)))


def test_values_that_fall_too_fast_everywhere_cost_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pairs of intervals on different sides would have to be looked at: their number grows with its square."""
    parts = [2.0 * n / 201 for n in range(1, 201)]
    monkeypatch.setattr(checker, "MOST_CELLS", 1 << 12)
    with pytest.raises(checker.Refused, match="values fall faster than the cost, or too nearly so, at many places"):
        packed_and_checked(*single(lambda at: 1e3 * at[:, 1], parts, 8.0))


@examples(12)
@given(st.integers(0, 10**6), st.sampled_from([0, 1, 2, 5]), st.floats(0.8, 1.2))
def test_values_are_taken_only_if_no_two_places_differ_by_more(seed: int, m: int, scale: float) -> None:
    """Sampled places of the border are the oracle: a file that is taken has none that differ by more than they cost."""
    rng = np.random.default_rng(seed)
    parts = np.sort(rng.random(m)) * 1.8 + 0.1
    sources, offsets = rng.uniform(-1.0, 3.0, (3, 2)), rng.uniform(0.0, 2.0, 3)

    def heights(at: Any) -> Any:  # noqa: ANN401 - arrays
        return scale * (3.0 * np.hypot(*(at[:, None] - sources).transpose(2, 0, 1)) + offsets).min(axis=1)

    knots = np.concatenate([[0.0], parts, [2.0]])
    t = np.union1d(np.linspace(0.0, 2.0, 41), knots)
    values = np.concatenate([np.interp(t, knots, heights(of)) for of in on_border(knots)])
    places = np.concatenate(on_border(t))
    far = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    worst = float((np.abs(values[:, None] - values) - 3.0 * far).max())
    if worst > 1e-5:
        with pytest.raises(checker.Refused, match="values fall faster"):
            packed_and_checked(*single(heights, parts.tolist(), 0.0))
    elif worst < -1e-5 or scale < 0.95:
        assert packed_and_checked(*single(heights, parts.tolist(), 0.0))["lower"] == 0.0


# mutants


def mutated(described: dict[str, Any], arrays: dict[str, Any], draw: Any) -> str:  # noqa: ANN401 - a source of numbers
    """Change a file at random; return how."""
    kind = draw.choice(["raise", "raise most", "drop", "cost", "lower", "line", "corner", "k"])
    level = described["cells"]["levels"][draw.integers(len(described["cells"]["levels"]))]
    surface = level[draw.choice(["to_goal", "to_start"])]
    values = np.cumsum(arrays[surface["values"]].astype(np.int64))
    if kind == "raise":
        values[draw.integers(len(values))] += int(np.ptp(values) * 10.0 ** draw.uniform(-3.0, 0.0))
    elif kind == "raise most":
        values += (draw.random(len(values)) < 0.5) * int(np.ptp(values) * 10.0 ** draw.uniform(-3.0, -1.0))
    elif kind == "corner":
        values[: len(values) // 20] = values[draw.integers(len(values))]
    elif kind == "drop":
        described["cells"]["limit"] *= 1.0 - 10.0 ** draw.uniform(-4.0, -1.0)
    elif kind == "cost":
        name = described["problem"]["rasters"][0]["values"]
        held = arrays[name].copy()
        i, j = (draw.integers(n) for n in held.shape)
        held[i, j] *= draw.choice([0.0, 0.5, 0.9])
        arrays[name] = held
    elif kind == "lower":
        described["lower"] *= 1.0 + 10.0 ** draw.uniform(-6.0, -1.0)
    elif kind == "k":
        described["problem"]["k"] *= 1.0 - 10.0 ** draw.uniform(-4.0, -0.5)
    else:
        name = described["cells"][draw.choice(["x", "y"])]
        lines = arrays[name].copy()
        lines[draw.integers(1, len(lines) - 1), draw.integers(2)] += draw.normal() * 0.3
        arrays[name] = lines
    arrays[surface["values"]] = np.diff(values, prepend=0)
    return str(kind)


def refused_or_true(problem: cg.Problem, seeds: range) -> dict[str, list[int]]:
    """Change files; those that are taken have to be true of their own problem."""
    data, _, best = proof_of(problem)
    counts: dict[str, list[int]] = {}
    for seed in seeds:
        described, arrays = parts_of(data)
        kind = mutated(described, arrays, np.random.default_rng(seed))
        count = counts.setdefault(kind, [0, 0])
        try:
            found = packed_and_checked(described, arrays)
        except checker.Refused:
            count[0] += 1
            continue
        count[1] += 1
        field = cg.RiskField(
            rasters=[raster(arrays[one["values"]], tuple(one["bounds"])) for one in described["problem"]["rasters"]]
        )
        changed = cg.Problem(problem.start, problem.goal, field, described["problem"]["k"], problem.bounds)
        cheapest = min(changed.evaluate(best.path).cost, cg.solve(changed, "weighted-regions").cost)
        assert found["lower"] <= min(cheapest, found["upper"]), (kind, seed)
    return counts


def test_mutants_are_refused_or_true() -> None:
    refused_or_true(noise(), range(12))


@pytest.mark.slow
@pytest.mark.parametrize("problem", [noise(), SHARED], ids=["noise", "shared"])
def test_many_mutants_are_refused_or_true(problem: cg.Problem) -> None:
    counts = refused_or_true(problem, range(200))
    refused = sum(of[0] for of in counts.values())
    assert refused > 100, counts
    assert len(counts) == 8


@examples(6)
@given(st.integers(0, 10**6))
def test_no_path_costs_less(seed: int) -> None:
    """Random paths, along lines and diagonals too, over rasters that share lines or overlap."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    boxes = [(0.0, 0.0, 1.0, 1.0), (0.0, 0.0, 1.0, 1.0) if rng.random() < 0.5 else (-0.3, 0.21, 0.73, 1.4)]
    rasters = [raster(rng.integers(0, 9, (n, n)), box) for box in boxes]
    start, goal = (tuple(rng.integers(0, 2 * n + 1, 2) / (2 * n)) for _ in range(2))
    if start == goal:
        return
    problem = cg.Problem(start, goal, cg.RiskField(rasters=rasters), 3.0)
    data, lower, best = proof_of(problem, 0.05)
    described, arrays = parts_of(data)
    archive = Archive()
    archive.arrays = arrays
    held = checker.Problem(described["problem"], archive.array)
    assert lower <= best.cost * (1.0 + 1e-12)
    for count, exact in itertools.product((0, 1, 2, 4, 8), (True, False)):
        some = rng.integers(0, n + 1, (count, 2)) / n if exact else rng.random((count, 2))
        assert lower <= checker.upper_bound(held, np.vstack([start, some, goal]))


def test_a_known_cost_caps_the_bound(tmp_path: Path) -> None:
    """A cost that no path has: cells are left out by it, and the bound is no greater."""
    _, lower, best = proof_of(noise())
    found = cg.save_proof(noise(), tmp_path / "one.proof", best.path, tolerance=0.01, known=0.9 * lower)
    assert found["lower"] == 0.9 * lower


def test_where_the_checker_refuses_cells_a_grid_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    archive = Archive()
    checked_problem = checker.Problem(describe_problem(noise(), archive), archive.array)
    monkeypatch.setattr(proof_of_cells, "LESS", (-10.0,))
    assert proof_of_cells.describe_cells(noise(), checked_problem, archive, 0.01, math.inf) is None
