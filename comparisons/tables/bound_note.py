"""What gaps are relative to, in one line."""

import math
from collections.abc import Sequence

from cgla_graph.comparisons.numbers import duration, rounded_down
from cgla_graph.comparisons.study.rows import scenario_bound
from cgla_graph.comparisons.study.runner import Run


def bound_note(runs: Sequence[Run], unit: str = "") -> str:
    """Say in one line what gaps of a scenario are relative to; empty where no bound is known and none was asked for."""
    bound = scenario_bound(runs)
    proof = next((run.certificate for run in runs if run.certificate is not None), None)
    if proof is None:
        known = f"how far above the lower bound {rounded_down(bound, 6)}{unit} that a solver proved"
        return "" if math.isnan(bound) else known
    if math.isnan(proof.lower_bound):
        return f"not known, as no lower bound could be proven: {proof.message}"
    if math.isinf(proof.lower_bound):
        return f"none, as it is proven that there is no path: {proof.message}"
    grid = f"grid step {proof.spacing:.3g}{unit}, " if proof.spacing > 0.0 else ""
    missed = "" if proof.reached else f"; not as tight as asked for: {proof.message}"
    return (
        f"how far above the proven lower bound {rounded_down(bound, 6)}{unit} ({grid}{duration(proof.seconds)}){missed}"
    )
