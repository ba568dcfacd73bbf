"""The experiment of C18 measures the same in every case."""

import pytest

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.contrasts import CELLS
from cgla_graph.comparisons.claims.paper import convergence_claims


@pytest.mark.slow
def test_the_exclusion_experiment_measures_every_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convergence_claims, "CELLS", CELLS[1:2], raising=False)
    monkeypatch.setattr(convergence_claims, "RADII", (0.2,), raising=False)
    assert len(catalogue.experiments()["exclusion"].sample(5)) == 4
