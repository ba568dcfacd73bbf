"""What a study of claims found, as one document, and written for people."""

from collections.abc import Sequence
from typing import Any

from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import finding_document
from cgla_graph.comparisons.claims.evidence import Scale


def results_document(results: Sequence[Result], scale: Scale) -> dict[str, Any]:
    """Return everything that is known as one JSON document."""
    return {
        "maps": scale.maps,
        "seed": scale.seed,
        "quick": scale.quick,
        "claims": [
            {
                "id": result.claim.id,
                "place": result.claim.place,
                "sentence": result.claim.sentence,
                "reads": result.claim.reads,
                **finding_document(result.finding),
            }
            for result in results
        ],
    }
