"""Claims in the terminal."""

from collections.abc import Sequence

from cgla_graph.comparisons import console
from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.evidence import Scale


def print_results(results: Sequence[Result], scale: Scale) -> None:
    """Print a line for each statement."""
    for result in results:
        for row in result.finding.rows:
            console.out(
                f"{result.claim.id}  {row.statement}  {row.answer.label}  {row.where}  {row.size}  {row.printed}"
            )
    console.out(f"seed {scale.seed}")
