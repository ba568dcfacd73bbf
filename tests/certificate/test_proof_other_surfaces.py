"""Surfaces of other methods in the format: the argument does not ask where a surface is from."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cgla_graph as cg
from tests.support.proofs import checked, fault_of, parts_of, put_values, values_of

SCRIPT = Path(__file__).parents[2] / "examples" / "proofs" / "other_surface.py"
#: The problem of the script.
PROBLEM = cg.Problem(
    (0.15, 0.3), (0.85, 0.75), cg.RiskField([cg.Threat(0.5, 0.5, 0.15, 0.6), cg.Threat(0.3, 0.8, 0.1, 0.8)]), k=4.0,
    bounds=(0.0, 0.0, 1.0, 1.0),
)  # fmt: skip


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file that the example writes."""
    found = tmp_path_factory.mktemp("proof") / "other.proof"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(found)], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("no path costs less than 1.09")
    return found


@pytest.mark.slow
def test_a_surface_of_a_linear_program_is_verified(file: Path) -> None:
    found = cg.verify_proof(file, PROBLEM)
    best = cg.solve(PROBLEM, "hybrid").cost
    assert 0.75 * best < found["lower"] < best <= found["upper"]


def test_it_claims_no_more_than_it_proves(file: Path) -> None:
    described, arrays = parts_of(file.read_bytes())
    more = described | {"lower": np.nextafter(described["lower"], 9.0)}
    assert "which is less than" in fault_of(more, arrays)
    surface = described["grids"][0]["to_goal"]
    put_values(surface, arrays, 1.01 * values_of(surface, arrays))
    assert "which is less than" in fault_of(described | {"lower": 1.01 * described["lower"]}, arrays)
    # (steeper than the cost by 1 %, it still proves something: what is too steep is charged for)
    put_values(surface, arrays, values_of(surface, arrays) / 1.01 / 1.0000001)
    assert checked(described | {"lower": 0.999 * described["lower"]}, arrays)
