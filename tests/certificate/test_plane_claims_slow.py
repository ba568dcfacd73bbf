"""No claim of a slow solver, or of one that draws samples, about all paths is refuted by a path, on random problems."""

import math
from typing import Any

import plane_claims
import pytest
import strategies
from plane_claims import faults

from cgla_graph.solvers import registry

#: Problems of each solver, as `make check` runs them.
NUMBER = math.ceil(30 * strategies.TIMES)
#: Small budgets: a solver that finds nothing must not be believed either.
SMALL: dict[str, dict[str, Any]] = {
    **{f"{name}-star": {"iterations": 40} for name in ("rrt", "informed-rrt", "sorrt", "bit")},
    **{f"{name}-star": {"samples": 40} for name in ("fmt", "bfmt")},
    **{f"{name}-star": {"milestones": 40} for name in ("prm", "ompl-prm")},
    "evolutionary": {"generations": 2},
    "q-learning": {"episodes": 30},
}
NAMES = [name for name in registry.names() if name not in plane_claims.QUICK and not registry.missing(name)]

pytestmark = pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.SmallSpreadWarning")


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    plane_claims.make_quick(monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_no_path_refutes_what_is_said_of_the_plane(name: str) -> None:
    for number in range(NUMBER):
        limited = "risk" if number % 2 else "length"
        assert faults(number, name, limited, **SMALL.get(name, {})) == []
