"""Proof files in parts: read, changed, written again, and the problem that one is about, as the library sees it."""

import bz2
import io
import json
import math
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np
import shapely

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate import proof_file
from cgla_graph.certificate.proof_file import Archive
from cgla_graph.refine.refine import refine_path

Described = dict[str, Any]
Arrays = dict[str, Any]

WALL = shapely.box(0.45, -0.2, 0.55, 0.62)
THREATS = cg.Threat(0.3, 0.35, 0.1, 0.7), cg.Threat(0.7, 0.7, 0.12, 0.8)
OPEN = cg.Problem((0.12, 0.2), (0.9, 0.65), cg.RiskField(THREATS), k=8.0)
WALLED = cg.Problem((0.12, 0.2), (0.9, 0.25), cg.RiskField(THREATS), k=8.0, no_fly=WALL)
HILLS = np.add.outer(np.sin(np.arange(10.0)) + 1.0, np.cos(np.arange(12.0)) + 1.0)
NEAREST, BILINEAR = (
    cg.Problem((0.12, 0.2), (0.9, 0.65), cg.RiskField(rasters=[cg.RasterRisk(HILLS, box, interpolation=way)]), k=0.5)
    for way, box in (("nearest", (0.0, 0.0, 1.0, 1.0)), ("bilinear", (-0.3, 0.1, 0.7, 1.3)))
)
#: Problems, and tolerances that one or two grids are enough for.
PROBLEMS = {"open": (OPEN, 0.002), "walled": (WALLED, 0.04), "nearest": (NEAREST, 0.15), "bilinear": (BILINEAR, 0.15)}


@contextmanager
def changeable() -> Iterator[None]:
    """Write files that tests may change: differences along rows alone, and both surfaces on the last grid too."""
    one_or_both = proof_file._Writer.both

    def both(self: Any, level: Any, sheet: Any, found: Sequence[Any], cost: float) -> tuple[dict[str, Any], float]:  # noqa: ANN401 - passed on
        surfaces, best = one_or_both(self, level, sheet, found, math.inf)
        return surfaces, min(best, cost)

    with patch.object(proof_file, "AXES", 1), patch.object(proof_file._Writer, "both", both):
        yield


@cache
def proof_of(problem: cg.Problem, tolerance: float) -> bytes:
    """Return the bytes of a proof file with the path of a planner."""
    import tempfile  # noqa: PLC0415 - beside its only use
    from pathlib import Path  # noqa: PLC0415 - the same

    with tempfile.TemporaryDirectory() as folder, changeable():
        file = Path(folder) / "one.proof"
        cg.save_proof(problem, file, cg.solve(problem, "hybrid").path, tolerance=tolerance)
        return file.read_bytes()


def parts_of(data: bytes) -> tuple[Described, Arrays]:
    """Return the description and the arrays of a file."""
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        held = {name: file.read(name) for name in file.namelist()}
        described = json.loads(held.pop("proof.json"))
        unpacked = {name: bz2.decompress(data) if name.endswith(".bz2") else data for name, data in held.items()}
        return described, {name: np.load(io.BytesIO(data)) for name, data in unpacked.items()}


def stored(described: Described, arrays: Arrays, method: int = zipfile.ZIP_STORED) -> io.BytesIO:
    """Write a file with arrays as they are; bytes stand for themselves."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as file:
        file.writestr("proof.json", json.dumps(described))
        for name, array in arrays.items():
            held = io.BytesIO(array if isinstance(array, bytes) else b"")
            if not isinstance(array, bytes):
                np.save(held, array)
            file.writestr(name, bz2.compress(held.getvalue()) if name.endswith(".bz2") else held.getvalue())
    stream.seek(0)
    return stream


def checked(described: Described, arrays: Arrays) -> checker.Result:
    """Check a file made of such parts."""
    return checker.check(stored(described, arrays))


def packed_and_checked(described: Described, arrays: Arrays) -> checker.Result:
    """Check a file made of such parts, as the library packs it."""
    archive = Archive()
    archive.arrays = arrays
    return checker.check(io.BytesIO(archive.packed(described)))


def fault_of(described: Described, arrays: Arrays) -> str:
    """Return why a file is refused; empty if it is not."""
    try:
        checked(described, arrays)
    except checker.Refused as error:
        return str(error) or "no reason"
    return ""


def problem_of(described: Described, arrays: Arrays) -> cg.Problem:
    """Return the problem of a file as the library takes it: nothing of the checker has a part in it."""
    one = described["problem"]
    threats = [cg.Threat(*row) for row in arrays[one["threats"]].tolist()]
    rasters = [
        cg.RasterRisk(arrays[raster["values"]], raster["bounds"], interpolation=raster["interpolation"], origin="lower")
        for raster in one["rasters"]
    ]
    area = None
    for ring in one["rings"]:
        polygon = shapely.Polygon(arrays[ring])
        area = polygon if area is None else area.symmetric_difference(polygon)
    return cg.Problem(
        tuple(one["start"]), tuple(one["goal"]), cg.RiskField(threats, rasters=rasters), one["k"],
        bounds=tuple(one["bounds"]), no_fly=area,
    )  # fmt: skip


def cheapest(problem: cg.Problem, paths: list[FloatArray]) -> tuple[float, FloatArray | None]:
    """Return the least cost of some paths that are feasible, after refining the best of them, and that path."""
    best, found = math.inf, None
    for path in paths:
        rated = problem.evaluate(path)
        if not rated.violations and rated.cost < best:
            best, found = rated.cost, path
    if found is None or len(found) < 2:
        return best, found
    refined = refine_path(problem, found, tolerance=1e-4)
    return min((best, found), (refined.cost, refined.path), key=lambda one: one[0])


def surfaces_of(described: Described, *, inner: bool = True) -> Iterator[dict[str, Any]]:
    """Yield the surfaces of a file, coarse to fine, and those inside of their blocks."""
    for grid in described["grids"] if "grids" in described else described["cells"]["levels"]:
        for name in ("to_goal", "to_start"):
            if name in grid:
                yield from within(grid[name], inner=inner)


def within(surface: dict[str, Any], *, inner: bool = True) -> Iterator[dict[str, Any]]:
    """Yield a surface, and those inside of its blocks."""
    yield surface
    for block in [*surface.get("blocks", []), *([surface["end"]] if "end" in surface else [])] if inner else []:
        if "inside" in block:
            yield from within(block["inside"]["surface"])


def whole_of(surface: dict[str, Any], arrays: Arrays) -> Any:  # noqa: ANN401 - an array
    """Return the whole numbers that the values of a surface are; those on cells are differences of one order less."""
    steps = arrays[surface["values"]].astype(np.int64)
    return np.cumsum(np.cumsum(steps)) if "blocks" in surface else np.cumsum(steps)


def put_whole(surface: dict[str, Any], arrays: Arrays, whole: Any) -> None:  # noqa: ANN401 - an array
    """Replace the whole numbers that the values of a surface are."""
    arrays[surface["values"]] = np.diff(
        whole, 2 if "blocks" in surface else 1, prepend=[0, 0][: 1 + ("blocks" in surface)]
    )


def values_of(surface: dict[str, Any], arrays: Arrays) -> FloatArray:
    """Return the values of a surface."""
    return np.ldexp(whole_of(surface, arrays).astype(float), -surface["exponent"])


def put_values(surface: dict[str, Any], arrays: Arrays, values: FloatArray, exponent: int | None = None) -> None:
    """Replace the values of a surface, rounded."""
    surface["exponent"] = surface["exponent"] if exponent is None else exponent
    put_whole(surface, arrays, np.rint(np.ldexp(values, surface["exponent"])).astype(np.int64))


def archive_of(arrays: Arrays) -> Archive:
    """Return a reader of arrays."""
    archive = Archive()
    archive.arrays = arrays
    return archive
