"""Proof files: what they prove, that false and broken ones are refused, and that the checker needs nothing of ours."""

import contextlib
import copy
import io
import json
import math
import subprocess
import sys
import time
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from proofs import HILLS, OPEN, THREATS, WALL, WALLED, changeable, packed_and_checked, parts_of, stored
from strategies import a_part_of

import cgla_graph as cg
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate.proof_file import Archive, describe_problem
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk import ImproperFieldWarning

CHECKER = Path(checker.__file__)
#: A gap that the first grid is enough for.
COARSE = 0.15
HILLY = [
    cg.RiskField(rasters=[cg.RasterRisk(HILLS, bounds=box, interpolation=way)])
    for way, box in (("nearest", (0.0, 0.0, 1.0, 1.0)), ("bilinear", (-0.3, 0.1, 0.7, 1.3)))
]
RASTERS = [cg.Problem((0.12, 0.2), (0.9, 0.65), field, k=0.5) for field in HILLY]


@cache
def proof_of(problem: cg.Problem, tolerance: float) -> tuple[bytes, float, float]:
    """Return a file, its bound, and the cost of its path."""
    import tempfile  # noqa: PLC0415 - beside its only use

    best = cg.solve(problem, "hybrid")
    with tempfile.TemporaryDirectory() as folder, changeable():
        file = Path(folder) / "one.proof"
        found = cg.save_proof(problem, file, best.path, tolerance=tolerance)
        return file.read_bytes(), found["lower"], best.cost


# what files prove


@pytest.mark.parametrize(
    ("problem", "tolerance"),
    [(OPEN, 0.02), (WALLED, COARSE), *(pytest.param(one, COARSE, marks=pytest.mark.slow) for one in RASTERS)],
    ids=["open", "walled", "nearest", "bilinear"],
)
def test_a_file_proves_a_bound_near_the_path(problem: cg.Problem, tolerance: float) -> None:
    data, lower, cost = proof_of(problem, tolerance)
    found = checker.check(io.BytesIO(data))
    assert found["lower"] == lower
    assert lower < cost <= lower * (1.0 + tolerance)
    assert cost * (1.0 - 1e-12) <= found["upper"] <= cost * (1.0 + 2e-6)


def test_the_gap_of_a_file_is_near_that_of_a_certificate(tmp_path: Path) -> None:
    certificate = cg.lower_bound(cg.load_scenario("one-threat").problem, 1e-3)
    loose = replace(certificate, tolerance=5e-3)
    found = loose.save(tmp_path / "one.proof")
    assert found["upper"] / found["lower"] - 1.0 <= 1.3 * loose.gap + 1e-7
    # (no finer than a tenth of the tolerance asks for)
    found = replace(certificate, tolerance=0.1).save(tmp_path / "one.proof")
    assert 2.0 * certificate.gap < found["upper"] / found["lower"] - 1.0 < 0.01


def test_no_path(tmp_path: Path) -> None:
    shut = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.45, -0.2, 0.55, 1.2))
    assert cg.save_proof(shut, tmp_path / "shut.proof")["lower"] == math.inf
    assert cg.verify_proof(tmp_path / "shut.proof", shut)["lower"] == math.inf


def test_the_checker_needs_nothing_of_ours(tmp_path: Path) -> None:
    copied, file = tmp_path / "alone.py", tmp_path / "one.proof"
    copied.write_bytes(CHECKER.read_bytes())
    file.write_bytes(proof_of(OPEN, 0.02)[0])
    blocked = f"import runpy, sys; sys.modules['cgla_graph'] = None; sys.argv = ['alone', {str(file)!r}]; "
    code = f"{blocked}runpy.run_path({str(copied)!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout.startswith("verified: no path costs less than "), done.stderr
    file.write_bytes(file.read_bytes()[:-30])
    done = subprocess.run(
        [sys.executable, "-I", str(copied), str(file)], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout.count("\n")) == (1, 1)
    assert done.stdout.startswith("refused: the file is not a proof: ")


def test_the_same_proof_is_the_same_file(tmp_path: Path) -> None:
    for name in ("one", "other"):
        cg.save_proof(OPEN, tmp_path / name, tolerance=0.5)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_a_proof_is_about_one_problem(tmp_path: Path) -> None:
    file = tmp_path / "one.proof"
    file.write_bytes(proof_of(WALLED, COARSE)[0])
    assert cg.verify_proof(file, WALLED)["lower"] == proof_of(WALLED, COARSE)[1]
    for other in (OPEN, cg.Problem((0.12, 0.2), (0.9, 0.25), cg.RiskField(THREATS), k=8.001, no_fly=WALL)):
        with pytest.raises(ProblemError, match="another problem"):
            cg.verify_proof(file, other)


def test_fields_without_a_bound_have_no_file(tmp_path: Path) -> None:
    with pytest.warns(ImproperFieldWarning):
        improper = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, 1.5)], improper=True)
    with pytest.raises(ProblemError, match="peaks above 1"):
        cg.save_proof(cg.Problem((0.1, 0.1), (0.9, 0.9), improper, k=5.0), tmp_path / "no.proof")
    assert not list(tmp_path.iterdir())


# files that are false


def cheaper(described: dict[str, Any], arrays: dict[str, Any], draw: Any) -> None:  # noqa: ANN401 - a source of numbers
    """Change a problem so that the file's own path, or the straight line, costs less than the bound."""
    problem = described["problem"]
    kind = draw.choice(
        ["k", "peaks", "spreads", "wall", "goal"] if problem["rings"] else ["k", "peaks", "spreads", "goal"]
    )
    share = 1.0 - 10.0 ** draw.uniform(-1.5, -0.5)
    if kind == "k":
        problem["k"] *= share
    elif kind == "goal":
        problem["goal"][0] -= (1.0 - share) * 0.3
        arrays[described["path"]] = np.array([problem["start"], problem["goal"]])
        problem["k"] = 0.0
    elif kind == "wall":
        arrays[problem["rings"][0]] = arrays[problem["rings"][0]] - np.array([0.0, 1.0 - share + 0.2])
        arrays[described["path"]] = np.array([problem["start"], (0.45, 0.62 - 0.2), (0.55, 0.42), problem["goal"]])
    else:
        column = 3 if kind == "peaks" else 2
        arrays[problem["threats"]] = arrays[problem["threats"]] * np.where(np.arange(4) == column, share, 1.0)


def refused_where_false(problem: cg.Problem, count: int) -> None:
    data, lower, _ = proof_of(problem, COARSE)
    draw = np.random.default_rng(7)
    false = 0
    while false < count:
        described, arrays = parts_of(data)
        cheaper(described, arrays, draw)
        archive = Archive()
        archive.arrays = arrays
        try:
            upper = checker.upper_bound(
                checker.Problem(described["problem"], archive.array), arrays[described["path"]].astype(float)
            )
        except checker.Refused:
            upper = math.inf
        if upper < lower:
            false += 1
            with pytest.raises(checker.Refused):
                packed_and_checked(described, arrays)


@pytest.mark.parametrize("problem", [OPEN, pytest.param(WALLED, marks=pytest.mark.slow)], ids=["open", "walled"])
def test_false_statements_are_refused(problem: cg.Problem) -> None:
    refused_where_false(problem, 4)


@pytest.mark.slow
@pytest.mark.parametrize("problem", [OPEN, WALLED], ids=["open", "walled"])
def test_many_false_statements_are_refused(problem: cg.Problem) -> None:
    refused_where_false(problem, len(a_part_of(range(150))))


def test_more_than_is_proven_is_refused() -> None:
    described, arrays = parts_of(proof_of(OPEN, 0.02)[0])
    described["lower"] = math.nextafter(described["lower"], math.inf)
    with pytest.raises(checker.Refused, match="which is less than"):
        packed_and_checked(described, arrays)
    described["lower"] = 0.9 * described["lower"]
    assert packed_and_checked(described, arrays)["lower"] == described["lower"]


def values_of(steps: Any) -> Any:  # noqa: ANN401 - an array
    return np.cumsum(np.cumsum(steps, dtype=np.int64))


def stepped(values: Any) -> Any:  # noqa: ANN401 - an array
    return np.diff(values, 2, prepend=[0, 0])


def raised(described: dict[str, Any], arrays: dict[str, Any], draw: Any) -> None:  # noqa: ANN401 - a source of numbers
    """Raise a control value on the last grid far beyond what the cost allows."""
    surface = described["grids"][-1]["to_goal"]
    values = values_of(arrays[surface["values"]])
    values[int(draw.integers(1, len(values) - 1))] += 1 << (surface["exponent"] - 2)
    arrays[surface["values"]] = stepped(values)


@pytest.mark.parametrize("seed", range(4))
def test_a_surface_too_steep_is_refused(seed: int) -> None:
    described, arrays = parts_of(proof_of(OPEN, 0.02)[0])
    del described["grids"][-1]["to_start"]
    raised(described, arrays, np.random.default_rng(seed))
    with pytest.raises(checker.Refused, match="which is less than"):
        packed_and_checked(described, arrays)


@pytest.mark.parametrize("more", [-1, 1])
def test_other_numbers_of_values_are_refused(more: int) -> None:
    described, arrays = parts_of(proof_of(WALLED, COARSE)[0])
    name = described["grids"][0]["to_goal"]["values"]
    arrays[name] = np.resize(arrays[name], len(arrays[name]) + more)
    with pytest.raises(checker.Refused, match="more or fewer control values"):
        packed_and_checked(described, arrays)


def test_a_surface_across_a_wall_is_refused() -> None:
    """Without parts, areas are not looked at: the surface on the whole map is continuous, and has too many values."""
    described, arrays = parts_of(proof_of(WALLED, COARSE)[0])
    described["grids"][0]["parts"] = 0
    with pytest.raises(checker.Refused, match="more or fewer control values"):
        packed_and_checked(described, arrays)


def test_a_path_through_a_wall_is_refused() -> None:
    described, arrays = parts_of(proof_of(WALLED, COARSE)[0])
    arrays[described["path"]] = np.array([described["problem"]["start"], described["problem"]["goal"]])
    with pytest.raises(checker.Refused, match="crosses an area after waypoint 0"):
        packed_and_checked(described, arrays)
    # along the rim and over a corner is allowed
    corners = [(0.45, 0.62), (0.55, 0.62)]
    arrays[described["path"]] = np.array([described["problem"]["start"], *corners, described["problem"]["goal"]])
    assert packed_and_checked(described, arrays)["upper"] >= proof_of(WALLED, COARSE)[1]


# changes that leave a proof true


def test_surfaces_may_be_shifted_and_flattened() -> None:
    described, arrays = parts_of(proof_of(OPEN, 0.02)[0])
    lower = described["lower"]
    for grid in described["grids"]:
        for name in ("to_goal", "to_start"):
            arrays[grid[name]["values"]] = stepped(values_of(arrays[grid[name]["values"]]) + 12345)
    described["lower"] = lower * (1.0 - 1e-12)
    assert packed_and_checked(described, arrays)["lower"] == described["lower"]
    # without the end's own grid, a cone is left: a true bound, and a lower one
    without = copy.deepcopy(described)
    for grid in without["grids"]:
        for name in ("to_goal", "to_start"):
            del grid[name]["end"]["inside"]
    with pytest.raises(checker.Refused, match="which is less than"):
        packed_and_checked(without, arrays)
    without["grids"], without["lower"] = without["grids"][:1], 0.9 * lower
    assert packed_and_checked(without, arrays)["lower"] == 0.9 * lower


def cone(x: Any, y: Any) -> Any:  # noqa: ANN401 - arrays
    """Return 0.99 times the distance to a goal."""
    return 0.99 * np.hypot(x - 0.75, y - 0.5)


def sheet_by_hand(archive: Archive, n: int, heights: Any, exponent: int) -> tuple[dict[str, Any], dict[str, Any]]:  # noqa: ANN401 - arrays
    """Describe a grid of n cells and a half at each side, and a surface on it with such control values."""
    values = archive.add(stepped(heights.ravel()), "values")
    return {"last": [n, n], "parts": 0}, {"exponent": exponent, "values": values, "blocks": []}


def by_hand(heights: Any, end: list[int], n: int = 32, **changes: Any) -> tuple[dict[str, Any], Archive]:  # noqa: ANN401 - as JSON
    """Describe a proof with a surface whose control values a formula gives: no solver of ours has a part in it."""
    exponent, archive = 30, Archive()
    rows, columns = np.mgrid[-1 : n + 2, -1 : n + 2]
    whole = np.rint(np.ldexp(heights(columns / n, rows / n), exponent)).astype(np.int64)
    grid, surface = sheet_by_hand(archive, n, whole, exponent)
    problem = {
        "start": [0.25, 0.5],
        "goal": [0.75, 0.5],
        "bounds": [0.0, 0.0, 1.0, 1.0],
        "k": 0.0,
        "threats": archive.add(np.empty((0, 4)), "threats"),
        "rasters": [],
        "rings": [],
        "on_earth": False,
    } | changes
    described = {
        "format": checker.FORMAT,
        "version": checker.VERSION,
        "problem": problem,
        "grids": [grid | {"to_goal": surface | {"end": {"cells": end}}}],
        "lower": 0.47,
        "limit": None,
        "path": archive.add(np.array([problem["start"], problem["goal"]]), "path"),
    }
    return described, archive


def whole_grid(problem: checker.Problem, n: int, parts: int = 0) -> checker.Grid:
    """Lay a grid over the whole map."""
    return checker.Grid.over(problem, [n, n], parts, [0, n + 1, 0, n + 1])


def test_a_surface_of_another_method() -> None:
    """The distance to the goal, by a formula: no solver of ours has a part in it."""
    described, archive = by_hand(cone, [22, 27, 14, 19])
    found = checker.check(io.BytesIO(archive.packed(described)))
    assert found["upper"] == pytest.approx(0.5, rel=1e-12)
    described["lower"] = 0.5 + 1e-9
    with pytest.raises(checker.Refused):
        checker.check(io.BytesIO(archive.packed(described)))


# files by hand that try to break a rule


def test_a_path_over_corners_through_an_area_is_refused() -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    ring = np.array([(0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6)])
    problem = checker.Problem(described["problem"] | {"rings": [archive.add(ring, "ring")]}, archive.array)
    checker.check_free(problem, np.array([(0.25, 0.5), (0.4, 0.6), (0.6, 0.6), (0.75, 0.5)]))
    with pytest.raises(checker.Refused, match="crosses an area after waypoint 1"):
        checker.check_free(problem, np.array([(0.25, 0.5), (0.4, 0.4), (0.6, 0.6), (0.75, 0.5)]))


@pytest.mark.parametrize("axes", [0, 3, 1.0, [2], None])
def test_values_have_one_or_two_axes(axes: object) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    described["grids"][0]["to_goal"]["axes"] = axes
    with pytest.raises(checker.Refused, match=r"axes are neither|a number is none"):
        checker.check(io.BytesIO(archive.packed(described)))


def test_the_least_whole_number_is_no_control_value() -> None:
    """Its absolute value is itself, and twice it is 0."""
    described, archive = by_hand(lambda x, y: 0.0 * x * y - 2.0**-30, [22, 27, 14, 19], start=[0.265625, 0.515625])
    surface = described["grids"][0]["to_goal"]
    values = values_of(archive.arrays[surface["values"]])
    values[17 * 35 + 9] = np.iinfo(np.int64).min
    archive.arrays[surface["values"]] = stepped(values)
    surface["exponent"] = 60
    with pytest.raises(checker.Refused, match="a control value is too great"):
        checker.check(stored(described, archive.arrays))


@pytest.mark.parametrize(
    ("reach", "message"), [(27, "is across its rim"), (36, "is across its rim"), (12, "which is less than")]
)
def test_a_block_inside_is_not_across_the_rim(reach: int, message: str) -> None:
    """Inside of its own block, the inner surface may be anything: here, 100."""
    described, archive = by_hand(cone, [22, 27, 14, 19])
    n = 160
    rows, columns = np.mgrid[-1 : n + 2, -1 : n + 2]
    apart = np.maximum(np.abs(columns - 120), np.abs(rows - 80))
    heights = np.where(apart <= reach - 2, 100.0, cone(columns / n, rows / n))[41:123, 81:163]
    _, surface = sheet_by_hand(archive, n, np.rint(np.ldexp(heights, 30)).astype(np.int64), 30)
    cells = [120 - reach, 121 + reach, 80 - reach, 81 + reach]
    inside = {"finer": 5, "parts": 0, "box": [81, 161, 41, 121], "surface": surface | {"end": {"cells": cells}}}
    described["grids"][0]["to_goal"]["end"]["inside"] = inside
    described["lower"] = 0.6
    with pytest.raises(checker.Refused, match=message):
        checker.check(io.BytesIO(archive.packed(described)))


def test_a_raster_beyond_the_map_counts_on_the_border() -> None:
    """A path along the western border has the lesser risk of both sides."""
    archive = Archive()
    values = archive.add(np.array([[0.0, 1.0]]), "raster")
    raster = {"values": values, "bounds": [-1.0, 0.0, 1.0, 1.0], "interpolation": "nearest"}
    described, by = by_hand(
        lambda x, y: 1.98 * np.hypot(x, y - 0.75), [-2, 3, 22, 27],
        start=[0.0, 0.25], goal=[0.0, 0.75], k=1.0, rasters=[raster | {"values": "raster"}],
    )  # fmt: skip
    by.arrays["raster"] = archive.arrays[values]
    described["lower"] = 0.9
    with pytest.raises(checker.Refused, match="which is less than"):
        checker.check(io.BytesIO(by.packed(described)))
    problem = checker.Problem(described["problem"], by.array)
    assert checker.upper_bound(problem, np.array([(0.0, 0.25), (0.0, 0.75)])) == pytest.approx(0.5)
    grid = whole_grid(problem, 32)
    costs, columns = grid.costs.max(axis=(1, 2)), grid.columns
    assert (costs[columns == 0] <= 1.0).all()
    assert costs[columns > 0] == pytest.approx(2.0)


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-12])
def test_a_line_of_several_rasters_has_the_least_of_each(off: float) -> None:
    """On both sides of the line, the cost is 91; a path along it costs 1 a unit of length."""
    by = Archive()
    rasters = [
        {"values": by.add(np.array([values]), "raster"), "bounds": bounds, "interpolation": "nearest"}
        for values, bounds in (([0.0, 9.0], [0.0, 0.0, 1.0, 1.0]), ([9.0, 0.0], [off, 0.0, 1.0 + off, 1.0]))
    ]
    described, archive = by_hand(
        lambda x, y: 90.0 * np.hypot(x - 0.5, y - 0.75), [15, 19, 24, 28], 33,
        start=[0.5, 0.25], goal=[0.5, 0.75], k=10.0, rasters=rasters,
    )  # fmt: skip
    archive.arrays |= {one["values"]: by.arrays[one["values"]] for one in rasters}
    described["lower"] = 40.0
    with pytest.raises(checker.Refused, match="which is less than"):
        checker.check(io.BytesIO(archive.packed(described)))
    problem = checker.Problem(described["problem"], archive.array)
    grid = whole_grid(problem, 33)
    costs = grid.costs.max(axis=(1, 2))
    assert (costs[(grid.columns == 16) | (grid.columns == 17)] <= 1.0).all()
    assert costs[(grid.columns > 17) & (grid.columns < 33)] == pytest.approx(91.0)
    if off == 0.0:
        assert checker.upper_bound(problem, np.array([(0.5, 0.25), (0.5, 0.75)])) == pytest.approx(0.5)


def test_lines_of_a_raster_through_middles_of_cells_lose_nothing() -> None:
    field = cg.RiskField(rasters=[cg.RasterRisk(HILLS, (0.0, 0.0, 1.0, 1.0), interpolation="bilinear")])
    archive = Archive()
    described = describe_problem(cg.Problem((0.12, 0.2), (0.9, 0.65), field, k=0.5), archive)
    last = [2 * n for n in HILLS.T.shape]
    grid = checker.Grid.over(checker.Problem(described, archive.array), last, 0, [0, last[0] + 1, 0, last[1] + 1])
    for n in range(4):
        column, row = n % 2, n // 2
        corners = np.column_stack([grid.boxes[column] / grid.units[0], grid.boxes[2 + row] / grid.units[1]])
        assert grid.costs[:, 2 * row, 2 * column] == pytest.approx(1.0 + 0.5 * field.density(corners), rel=1e-9)


@given(st.floats(-0.5, 0.5))
@example(-0.25)
def test_an_end_on_the_rim_costs_nothing(shift: float) -> None:
    n = 32
    described, archive = by_hand(
        lambda x, y: 0.9 * np.maximum(x - 0.5 + 0.5 / n, 0.0) + 0.0 * y,
        [14, 19, 16, 19], goal=[0.5 + shift / n, 0.5 - 0.5 / n],
    )  # fmt: skip
    problem = checker.Problem(described["problem"], archive.array)
    surface = described["grids"][0]["to_goal"]
    whole = checker.Surface(surface, archive.array, whole_grid(problem, n), problem.goal)
    whole.in_block[:] = False
    assert whole.bound(problem.goal) <= 0.0


@pytest.mark.parametrize("header", [b"{'descr': '<f8', (((\n", b'"""\n', b"\xff\xfe"])
def test_broken_headers_of_arrays_are_refused(header: bytes) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    data = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with pytest.raises(checker.Refused, match="not a proof"):
        checker.check(stored(described, archive.arrays | {described["problem"]["threats"]: data}))


@pytest.mark.parametrize("name", ["one\nverified: no path costs less than 9.npy", "\u202e.npy", "\x1b[2J.npy"])
def test_names_in_a_file_say_nothing(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    described["problem"]["threats"] = name
    file = tmp_path / "one.proof"
    file.write_bytes(stored(described, archive.arrays | {name: np.zeros(3)}).getvalue())
    assert checker.main([str(file)]) == 1
    assert capsys.readouterr().out == "refused: a name of an array is not plain\n"


# hostile files


def lying(described: dict[str, Any], name: str, said: bytes, method: int) -> bytes:
    """Return a file with a part of 64 MB that says that it is small."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
        if name != "proof.json":
            file.writestr("proof.json", json.dumps(described))
        file.writestr(name, said + bytes(1 << 26), method)
    data = bytearray(stream.getvalue())
    # (sum and size in the directory at the end)
    at = data.rfind(b"PK\x01\x02")
    data[at + 16 : at + 20], data[at + 24 : at + 28] = (
        zlib.crc32(said).to_bytes(4, "little"),
        len(said).to_bytes(4, "little"),
    )
    return bytes(data)


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("name", ["proof.json", "threats.npy"])
def test_parts_that_say_they_are_small_take_little_memory(name: str, method: int) -> None:
    described, _ = by_hand(cone, [22, 27, 14, 19])
    described["problem"]["threats"] = "threats.npy"
    held = io.BytesIO()
    np.save(held, np.zeros((4, 4)))
    data = lying(described, name, json.dumps({}).encode() if name == "proof.json" else held.getvalue(), method)
    tracemalloc.start()
    try:
        with pytest.raises(
            checker.Refused, match=r"another method than deflate|the format is not|a spread is not above 0"
        ):
            checker.check(io.BytesIO(data))
        assert tracemalloc.get_traced_memory()[1] < 1 << 24
    finally:
        tracemalloc.stop()


def test_arrays_unpack_to_no_more_than_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    described["problem"]["threats"] = archive.add(np.zeros((1 << 20, 4)), "threats")
    data = archive.packed(described)
    assert len(data) < 100_000
    monkeypatch.setattr(checker, "MOST_IN_ALL", 1 << 20)
    tracemalloc.start()
    try:
        with pytest.raises(checker.Refused, match="too large together, or one is cut off"):
            checker.check(io.BytesIO(data))
        assert tracemalloc.get_traced_memory()[1] < 1 << 23
    finally:
        tracemalloc.stop()


def test_the_rim_of_a_block_has_few_pieces() -> None:
    """All pairs of an outer and an inner piece are looked at: 1,700 and 8,500 here."""
    described, archive = by_hand(cone, [22, 27, 14, 19])
    n = 420
    grid, surface = sheet_by_hand(archive, n, np.zeros((n + 3, n + 3), dtype=np.int64), 0)
    _, inner = sheet_by_hand(archive, 3 * n, np.zeros((3 * n - 1, 3 * n - 1), dtype=np.int64), 0)
    inside = {"finer": 3, "parts": 0, "box": [2, 3 * n - 1, 2, 3 * n - 1], "surface": inner}
    end = {
        "cells": [2, n - 1, 2, n - 1],
        "inside": inside | {"surface": inner | {"end": {"cells": [9, 3 * n - 8] * 2}}},
    }
    described["grids"] = [grid | {"to_goal": surface | {"end": end}}]
    with pytest.raises(checker.Refused, match="the rim of a block has too many pieces"):
        checker.check(io.BytesIO(archive.packed(described)))


@pytest.mark.slow
@given(st.data())
def test_damaged_files_are_refused(data: st.DataObject) -> None:
    whole = proof_of(OPEN, 0.5)[0]
    at = data.draw(st.integers(0, len(whole) - 1))
    changed = data.draw(
        st.sampled_from([whole[:at], whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :], whole[at:]])
    )
    with contextlib.suppress(checker.Refused):
        # (a date, say, may be changed)
        assert checker.check(io.BytesIO(changed))["lower"] <= proof_of(OPEN, 0.5)[1]


WRONG: list[Any] = [None, True, -1, 1 << 60, 1e300, "", "0000-threats.npy", [], {}, [[[]]], math.nan]


@given(st.data())
def test_wrong_descriptions_are_refused(data: st.DataObject) -> None:
    described, arrays = parts_of(proof_of(OPEN, 0.5)[0])
    del described["grids"][0]["to_goal"]["end"]["inside"], described["grids"][0]["to_start"]
    at: Any = described
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(at[key], dict | list) or not at[key] or data.draw(st.booleans()):
            break
        at = at[key]
    at[key] = data.draw(st.sampled_from(WRONG))
    with contextlib.suppress(checker.Refused):
        checker.check(stored(described, arrays))


# what the checker is made of


@given(st.floats(-800.0, 0.0), st.floats(0.0, 1.0))
@example(0.0, 0.0)
@example(-700.0, 1e-9)
@example(-0.34657359, 0.0)
def test_exp_is_enclosed(x: float, width: float) -> None:
    found = checker.exp(checker.Interval(np.array([x - width * 1e-3]), np.array([x])))
    with localcontext() as context:
        context.prec, context.Emin = 60, -10_000
        assert Decimal(float(found.lo[0])) <= Decimal(x - width * 1e-3).exp()
        assert Decimal(float(found.hi[0])) >= Decimal(x).exp()


NUMBERS = st.floats(-1e6, 1e6)


@given(st.tuples(NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_operations_enclose_exact_results(
    one: tuple[float, float], other: tuple[float, float], s: float, t: float
) -> None:
    a, b = (checker.Interval(np.array([min(two)]), np.array([max(two)])) for two in (one, other))
    x, y = (
        Fraction(min(two)) + Fraction(w) * (Fraction(max(two)) - Fraction(min(two)))
        for two, w in ((one, s), (other, t))
    )
    cases = [(a + b, x + y), (a - b, x - y), (a * b, x * y), (a.square(), x * x)]
    cases += [(a / b, x / y)] if b.lo[0] > 0.0 else []
    for found, exact in cases:
        assert Fraction(float(found.lo[0])) <= exact <= Fraction(float(found.hi[0]))


@given(
    st.lists(st.tuples(st.integers(0, 24), st.integers(0, 24)), min_size=3, max_size=8, unique=True),
    st.floats(0.0, 1.0),
)
def test_closed_units_are_inside_areas(points: list[tuple[int, int]], turn: float) -> None:
    hull = shapely.MultiPoint(np.array(points) / 24.0).convex_hull
    area = shapely.affinity.rotate(hull, 360.0 * turn)
    if not isinstance(area, shapely.Polygon):
        return
    archive, n = Archive(), 16
    rings = [archive.add(shapely.get_coordinates(area.exterior)[:-1], "ring")]
    threats = archive.add(np.empty((0, 4)), "threats")
    described = {"start": [0.0, 0.0], "goal": [1.0, 1.0], "bounds": [0.0, 0.0, 1.0, 1.0], "k": 0.0, "threats": threats}
    problem = checker.Problem(described | {"rasters": [], "rings": rings, "on_earth": False}, archive.array)
    u, v = (one.ravel() for one in np.meshgrid(np.arange(2 * n), np.arange(2 * n)))
    squares = shapely.box(u / (2 * n), v / (2 * n), (u + 1) / (2 * n), (v + 1) / (2 * n))
    lines = checker.Interval(np.arange(2 * n) / (2 * n), np.arange(1, 2 * n + 1) / (2 * n))
    is_met, found = checker.areas_at(problem, [lines, lines], u, v)
    assert not (is_met & found).any()
    assert not (found & ~shapely.contains(area.buffer(1e-12), squares)).any()
    assert not (~found & shapely.contains(area.buffer(-1e-4), squares)).any()
    # the pieces of a grid are all the rest, and apart from one another
    grid = whole_grid(problem, n, 2)
    taken = np.zeros((2 * n, 2 * n), dtype=np.int64)
    for piece, (west, east, south, north) in enumerate(zip(*grid.sides, strict=True)):
        taken[south:north, west:east] += piece + 1
    assert ((taken.ravel() == 0) == found).all()
    # squares that touch are of one piece, or of pieces that share the values around both of their cells
    padded = np.pad(taken, 1) - 1
    places = (grid.rows[:, None] + np.arange(9) // 3) * (n + 3) + grid.columns[:, None] + np.arange(9) % 3
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        one = padded[1:-1, 1:-1].ravel()
        other = padded[1 + down : 2 * n + 1 + down, 1 + right : 2 * n + 1 + right].ravel()
        touch = (one >= 0) & (other >= 0) & (one != other)
        a, b = np.unique(np.column_stack([one[touch], other[touch]]), axis=0).T
        both = places[a][:, :, None] == places[b][:, None, :]
        assert (both.sum(axis=(1, 2)) >= 4).all()
        assert (grid.controls[a][:, :, None] == grid.controls[b][:, None, :])[both].all()


def test_a_wall_has_other_values_on_both_sides() -> None:
    archive = Archive()
    ring = archive.add(np.array([(0.501, -0.1), (0.502, -0.1), (0.502, 0.62), (0.501, 0.62)]), "ring")
    described, _ = by_hand(cone, [22, 27, 14, 19])
    problem = described["problem"] | {"rings": [ring], "threats": archive.add(np.empty((0, 4)), "threats")}
    grid = whole_grid(checker.Problem(problem, archive.array), 16, 128)
    west, east = (grid.pieces_at((x, 0.3)) for x in (0.45, 0.55))
    assert not set(grid.controls[west].ravel()) & set(grid.controls[east].ravel())
    above = grid.pieces_at((0.5, 0.75))
    assert len(above) >= 1
    assert grid.leads()


@pytest.mark.parametrize(
    "change",
    [
        {"last": [2, 1 << 29]},
        {"last": [1 << 20, 1 << 20]},
        {"last": [1 << 49, 2]},
        {"last": [2, 2, 2]},
        {"parts": 1 << 40},
        {"parts": 3},
    ],
)
def test_hostile_grids_are_refused(change: dict[str, Any]) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    described["grids"][0] |= change
    with pytest.raises(checker.Refused):
        checker.check(io.BytesIO(archive.packed(described)))


@pytest.mark.parametrize(("box", "parts"), [([0, 1, 0, 160], 4096), ([80, 81, 0, 1 << 40], 2), ([9, 3, 9, 3], 0)])
def test_hostile_blocks_are_refused(box: list[int], parts: int) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    ring = np.array([(0.4, 0.1), (0.4 + 1e-9, 0.1), (0.4, 0.9)])
    described["problem"]["rings"] = [archive.add(ring, "ring")]
    surface = described["grids"][0]["to_goal"]
    inside = {"finer": 5, "parts": parts, "box": box, "surface": copy.deepcopy(surface)}
    surface["blocks"] = [{"cells": [3, 6, 3, 6], "inside": inside}]
    with pytest.raises(checker.Refused):
        checker.check(io.BytesIO(archive.packed(described)))


def test_a_file_that_names_an_array_often_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    described, archive = by_hand(cone, [22, 27, 14, 19])
    ring = archive.add(np.zeros((1000, 2)), "ring")
    whole = archive.packed(described | {"problem": described["problem"] | {"rings": [ring] * 100}})
    monkeypatch.setattr(checker, "MOST_IN_ALL", 1_000_000)
    with pytest.raises(checker.Refused, match="the arrays that are named are too large together"):
        checker.check(io.BytesIO(whole))


def test_all_grids_of_a_file_have_a_number_of_cells() -> None:
    whole, _, _ = proof_of(OPEN, 0.5)
    last = parts_of(whole)[0]["grids"][0]["last"]
    with pytest.raises(checker.Refused, match="more work than is allowed"):
        checker.check(io.BytesIO(whole), 100 * (last[0] + 1) * (last[1] + 1) + 1)


def with_a_path(described: dict[str, Any], archive: Archive) -> None:
    """Lead a path of many segments along an area of many edges."""
    line = np.linspace(0.3, 0.7, 2000)
    ring = np.column_stack([np.append(line, 0.5), np.append(np.full(len(line), 0.5), 0.6)])
    described["problem"]["rings"] = [archive.add(ring, "ring")]
    described["path"] = archive.add(np.tile([(0.25, 0.5), (0.75, 0.5)], (2000, 1)), "path")


def with_blocks(described: dict[str, Any], archive: Archive) -> None:
    """Lay a hundred blocks with one large surface."""
    _, inner = sheet_by_hand(archive, 480, np.zeros((483, 483), dtype=np.int64), 0)
    inside = {"finer": 15, "parts": 0, "box": [-8, 482, -8, 482], "surface": inner}
    described["grids"][0]["to_goal"]["blocks"] = [
        {"cells": [2 * n, 2 * n + 1, 2 * m, 2 * m + 1], "inside": inside} for n in range(10) for m in range(10)
    ]


def with_a_raster(described: dict[str, Any], archive: Archive) -> None:
    """Lay few cells over a raster of many."""
    raster = {"values": archive.add(np.zeros((1500, 1500)), "raster"), "bounds": [0.0, 0.0, 1.0, 1.0]}
    described["problem"] |= {"k": 1.0, "rasters": [raster | {"interpolation": "nearest"}]}
    described["grids"][0]["last"] = [2, 2]


def with_many_grids(described: dict[str, Any], archive: Archive) -> None:
    """Lay many small grids over a raster of many columns."""
    raster = {"values": archive.add(np.zeros((1, 100_000)), "raster"), "bounds": [0.0, 0.0, 1.0, 1.0]}
    described["problem"] |= {"k": 1.0, "rasters": [raster | {"interpolation": "bilinear"}]}
    described["grids"][0]["to_goal"]["blocks"] = [
        {"cells": [2, 3, 2, 3], "inside": {"finer": 3, "parts": 0, "box": [0, 9 + n, 0, 9], "surface": {}}}
        for n in range(100)
    ]


def with_lines(described: dict[str, Any], archive: Archive) -> None:
    """Lay cells between many lines over a raster of many rows."""
    raster = {"values": archive.add(np.zeros((1 << 17, 1)), "raster"), "bounds": [0.0, 0.0, 1.0, 1.0]}
    described["problem"] |= {"k": 1.0, "rasters": [raster | {"interpolation": "nearest"}]}
    x, y = (np.repeat(np.linspace(0.0, 1.0, count), 2).reshape(-1, 2) for count in (2001, 3))
    described["cells"] = {"limit": None, "x": archive.add(x, "x"), "y": archive.add(y, "y"), "levels": []}
    described["problem"] |= {"start": [0.25, 0.5], "goal": [0.75, 0.5]}


def with_threats(described: dict[str, Any], archive: Archive) -> None:
    """Lay many cells over many threats."""
    described["problem"]["threats"] = archive.add(np.tile([0.5, 0.5, 0.1, 0.5], (50_000, 1)), "threats")
    described["grids"][0]["last"] = [300, 300]


@pytest.mark.parametrize(
    "hostile", [with_a_path, with_blocks, with_a_raster, with_threats, with_many_grids, with_lines]
)
def test_a_small_file_that_would_run_for_minutes_is_refused(hostile: Callable[..., None]) -> None:
    """Its own sizes say what it asks for: it is refused after a second of work."""
    described, archive = by_hand(cone, [22, 27, 14, 19])
    hostile(described, archive)
    data = archive.packed(described)
    assert len(data) < 50_000
    begin = time.process_time()
    with pytest.raises(checker.Refused, match=r"more work than is allowed \(--most-work N allows more\)"):
        checker.check(io.BytesIO(data), 2e7)
    assert time.process_time() - begin < 10.0


def test_more_work_is_allowed_on_demand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "one.proof"
    file.write_bytes(proof_of(OPEN, 0.02)[0])
    with pytest.raises(ProblemError, match="more work than is allowed"):
        cg.verify_proof(file, most_work=1e6)
    assert cg.verify_proof(file, most_work=1e9)["lower"] == proof_of(OPEN, 0.02)[1]
    assert checker.main([str(file), "--most-work", "1e6"]) == 1
    assert checker.main([str(file), "--most-work", "1e9"]) == 0
    assert checker.main([str(file), "--more"]) == 2
    capsys.readouterr()
    assert checker.main([str(file), "--most-work", "all\n"]) == 1
    assert capsys.readouterr().out == "refused: could not convert string to float: 'all\\n'\n"


@pytest.mark.slow
@pytest.mark.parametrize("problem", [OPEN, WALLED], ids=["open", "walled"])
def test_differences_along_columns_are_the_same_values(problem: cg.Problem, tmp_path: Path) -> None:
    """Files as the library writes them, where tests change those with differences along rows alone."""
    found = cg.save_proof(problem, tmp_path / "one.proof", cg.solve(problem, "hybrid").path, tolerance=COARSE)
    written, (data, lower, _) = tmp_path / "one.proof", proof_of(problem, COARSE)
    assert checker.check(str(written)) == {key: found[key] for key in ("lower", "upper", "problem")}
    described, arrays = parts_of(data)
    grid = parts_of(written.read_bytes())[0]["grids"][-1]
    # (one surface is enough)
    (name,) = {"to_goal", "to_start"} & set(grid)
    described["grids"][-1] = {key: described["grids"][-1][key] for key in grid}
    assert packed_and_checked(described | {"lower": found["lower"]}, arrays)["lower"] == found["lower"] <= lower
    with pytest.raises(checker.Refused, match=name):
        packed_and_checked(described | {"lower": np.nextafter(found["lower"], 9.0)}, arrays)
    assert written.stat().st_size < 0.6 * len(data)


def test_a_start_in_the_block_of_the_goal_has_a_bound(tmp_path: Path) -> None:
    """Without a path, there is one grid, and the start is in the goal's block."""
    near = cg.Problem((0.5, 0.5), (0.507, 0.503), cg.RiskField(THREATS), k=8.0, bounds=(0.0, 0.0, 1.0, 1.0))
    cost = near.evaluate(np.array([near.start, near.goal])).cost
    found = cg.save_proof(near, tmp_path / "one.proof")
    assert 0.9 * cost < found["lower"] < cost
    assert cg.verify_proof(tmp_path / "one.proof", near) == found


def test_a_map_of_few_floats_has_a_file(tmp_path: Path) -> None:
    origin, size = 1e6, 1e-7
    (x, y), (to_x, to_y) = ((origin + size * one, origin + size * other) for one, other in ((0.1, 0.5), (0.9, 0.5)))
    problem = cg.Problem((x, y), (to_x, to_y), bounds=(origin, origin, origin + size, origin + size))
    found = cg.save_proof(problem, tmp_path / "one.proof", np.array([problem.start, problem.goal]))
    assert 0.9 * found["upper"] < found["lower"] <= found["upper"]
    assert cg.verify_proof(tmp_path / "one.proof", problem) == found


@pytest.mark.parametrize(("spread", "k"), [(0.0129, 711.0), (0.0056, 72.0)])
def test_the_bound_of_the_cost_is_never_below_0(spread: float, k: float) -> None:
    """Where a threat is narrow, a linear function below the cost may be negative: a constant is above it."""
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.6, 0.4, spread)]), k=k)
    archive = Archive()
    costs = whole_grid(checker.Problem(describe_problem(problem, archive), archive.array), 128).costs
    assert costs.min() > 0.0


def test_the_cost_of_a_path_is_close_on_a_small_map_far_away() -> None:
    origin, size = 1e6, 2.0**-20
    places = origin + size * np.array([(0.0, 0.0), (1.0, 0.0), (0.5, 0.25)])
    problem = cg.Problem(
        tuple(places[0]), tuple(places[1]), cg.RiskField([cg.Threat(*places[2], size / 16.0)]), k=1e3,
        bounds=(*places[0], *(origin + size * np.ones(2))),
    )  # fmt: skip
    archive = Archive()
    checked = checker.Problem(describe_problem(problem, archive), archive.array)
    cost = problem.evaluate(places[:2]).cost
    assert cost * (1.0 - 1e-9) <= checker.upper_bound(checked, places[:2]) <= cost * (1.0 + 1e-6)
