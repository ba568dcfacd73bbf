"""Files that claim more than is true are refused, by class of what was changed; files that stay true are accepted."""

import copy
import zipfile
import zlib
from collections.abc import Callable

import numpy as np
import pytest
from strategies import a_part_of

from cgla_graph.certificate import check_proof as checker
from tests.support.proof_mutants import OF_SURFACES, ON_MAPS, Draw, mutant
from tests.support.proofs import (
    PROBLEMS,
    Arrays,
    Described,
    checked,
    fault_of,
    parts_of,
    proof_of,
    put_values,
    put_whole,
    stored,
    surfaces_of,
    values_of,
    whole_of,
)

CLASSES = ON_MAPS | OF_SURFACES
#: Mutants of each class and map, and changes that are tried for them: not each of them makes a claim false.
EACH, TRIES = 6, 60


def refused(name: str, problem: str, each: int, tries: int) -> int:
    """Check that mutants of a class are refused; return how many there were."""
    draw, count = np.random.default_rng(zlib.crc32(f"{name} {problem}".encode())), 0
    for _ in range(tries):
        found = mutant(*PROBLEMS[problem], CLASSES[name], draw)
        if found is None:
            continue
        described, arrays, cost = found
        assert described["lower"] > cost
        fault = fault_of(described, arrays)
        assert fault, f"{name}, {problem}: {described['lower']} is accepted, and a path costs {cost}"
        assert "\n" not in fault
        count += 1
        if count == each:
            break
    return count


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("k lowered", "nearest"), ("a threat moved", "open"),
        ("some surfaces scaled", "open"), ("blocks with a step", "open"),
    ],
)  # fmt: skip
def test_a_false_claim_is_refused(name: str, problem: str) -> None:
    assert refused(name, problem, 1, 20) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", CLASSES)
def test_false_claims_of_a_class_are_refused(name: str) -> None:
    each = len(a_part_of(range(EACH)))
    counts = [refused(name, problem, each, TRIES) for problem in PROBLEMS]
    assert sum(counts) >= each


# changes that leave a file true


def claimed_less(one: Described, arrays: Arrays, draw: Draw) -> None:
    one["lower"] *= draw.uniform(0.5, 1.0)


def shifted(one: Described, arrays: Arrays, draw: Draw) -> None:
    if "grids" not in one:
        for surface in surfaces_of(one):
            put_whole(surface, arrays, whole_of(surface, arrays) + 12345)
    for grid in one.get("grids", []):
        for name in ("to_goal", "to_start"):
            inside = grid.get(name)
            while inside:
                put_whole(inside, arrays, whole_of(inside, arrays) + (1 << inside["exponent"] - 8))
                inside = inside["end"].get("inside", {}).get("surface")
    one["lower"] *= 1.0 - 1e-12


def flattened(one: Described, arrays: Arrays, draw: Draw) -> None:
    del one.get("grids", [])[1:]
    share = draw.uniform(0.5, 0.999)
    for surface in surfaces_of(one):
        put_values(surface, arrays, share * values_of(surface, arrays), surface["exponent"] + 12)
    one["lower"] *= 0.9 * share


def finer_numbers(one: Described, arrays: Arrays, draw: Draw) -> None:
    for surface in surfaces_of(one):
        put_values(surface, arrays, values_of(surface, arrays), surface["exponent"] + int(draw.integers(1, 10)))


def without_finer_grids(one: Described, arrays: Arrays, draw: Draw) -> None:
    del (one.get("grids") or one["cells"]["levels"])[1:]
    one["lower"] *= 0.9


def without_the_path(one: Described, arrays: Arrays, draw: Draw) -> None:
    del one["path"]


def one_surface_on_the_last_grid(one: Described, arrays: Arrays, draw: Draw) -> None:
    del (one.get("grids") or one["cells"]["levels"])[-1][str(draw.choice(["to_goal", "to_start"]))]
    one["lower"] *= 0.99


def costlier(one: Described, arrays: Arrays, draw: Draw) -> None:
    """Raise the cost of the map: a bound stays one."""
    one["problem"]["k"] *= 1.0 + 10.0 ** draw.uniform(-6.0, -2.0)
    if "grids" in one:
        del one["grids"][1:]
        one["lower"] *= 0.9


def more_in_the_file(one: Described, arrays: Arrays, draw: Draw) -> None:
    one["remark"], arrays["more.npy"] = "as you like", np.zeros(3)


def other_kinds_of_arrays(one: Described, arrays: Arrays, draw: Draw) -> None:
    for name, array in arrays.items():
        arrays[name] = array.astype(">i8" if array.dtype.kind == "i" else ">f8")


def blocks_in_another_order(one: Described, arrays: Arrays, draw: Draw) -> None:
    for surface in surfaces_of(one):
        if "blocks" in surface:
            surface["blocks"].reverse()
    one["lower"] *= 1.0 - 1e-12


def anything_inside_of_blocks(one: Described, arrays: Arrays, draw: Draw) -> None:
    """Change the value in the middle of blocks around ends, which only cells of the block see."""
    grid = one.get("grids", [{}])[0]
    del one.get("grids", [])[1:]
    one["lower"] *= 0.9 if grid else 1.0
    for name in ("to_goal", "to_start"):
        if name in grid and not grid["parts"]:
            west, east, south, north = grid[name]["end"]["cells"]
            values, wide = values_of(grid[name], arrays), grid["last"][0] + 3
            values[((south + north) // 2 + 1) * wide + (west + east) // 2 + 1] += draw.normal()
            put_values(grid[name], arrays, values)


VALID: dict[str, Callable[[Described, Arrays, Draw], None]] = {
    "a lesser claim": claimed_less,
    "all surfaces shifted": shifted,
    "surfaces flattened": flattened,
    "finer numbers": finer_numbers,
    "without finer grids": without_finer_grids,
    "without the path": without_the_path,
    "one surface on the last grid": one_surface_on_the_last_grid,
    "a costlier map": costlier,
    "more in the file": more_in_the_file,
    "other kinds of arrays": other_kinds_of_arrays,
    "blocks in another order": blocks_in_another_order,
    "anything inside of blocks": anything_inside_of_blocks,
}


def accepted(name: str, problem: str, seed: int) -> None:
    described, arrays = parts_of(proof_of(*PROBLEMS[problem]))
    described = copy.deepcopy(described)
    VALID[name](described, arrays, np.random.default_rng(seed))
    assert fault_of(described, arrays) == ""
    assert checked(described, arrays)["lower"] == described["lower"]


@pytest.mark.parametrize("name", ["all surfaces shifted", "finer numbers", "anything inside of blocks"])
def test_a_file_that_stays_true_is_accepted(name: str) -> None:
    accepted(name, "open", 1)


@pytest.mark.slow
@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("name", VALID)
def test_files_that_stay_true_are_accepted(name: str, problem: str) -> None:
    for seed in a_part_of(range(2, 5)):
        accepted(name, problem, seed)


def test_compression_is_up_to_the_writer() -> None:
    described, arrays = parts_of(proof_of(*PROBLEMS["open"]))
    assert checker.check(stored(described, arrays, zipfile.ZIP_BZIP2))["lower"] == described["lower"]
