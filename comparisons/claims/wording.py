"""Findings in words, the same in the terminal, in the report and in the manual; and all of them as one document."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import Entry, Verdict, finding_document
from cgla_graph.comparisons.claims.evidence import Scale

#: Significant digits of numbers in tables.
DIGITS = 4
#: Whole numbers from here on get separators.
_MANY = 10_000


def written(entry: Entry) -> str:
    """
    Write an entry of a table.

    Examples
    --------
    >>> [written(entry) for entry in (0.123456, 79800, None, True, "exact")]
    ['0.1235', '79,800', '–', 'yes', 'exact']
    """
    if entry is None:
        return "–"
    if isinstance(entry, bool):
        return "yes" if entry else "no"
    if isinstance(entry, int):
        return f"{entry:,}" if abs(entry) >= _MANY else str(entry)
    return f"{entry:.{DIGITS}g}" if isinstance(entry, float) else entry


def is_number(entry: Entry) -> bool:
    """Tell whether an entry stands on the right of its column, as numbers do."""
    return entry is None or (isinstance(entry, int | float) and not isinstance(entry, bool))


def counts(results: Iterable[Result]) -> dict[Verdict, int]:
    """Count the verdicts, in the order in which they are defined, without those that do not occur."""
    found = Counter(result.finding.verdict for result in results)
    return {verdict: found[verdict] for verdict in Verdict if found[verdict]}


def counted(results: Sequence[Result]) -> str:
    """Say in one line how many claims got which verdict."""
    words = [f"{number} {verdict.label}" for verdict, number in counts(results).items()]
    return f"{len(results)} claim{'' if len(results) == 1 else 's'}: {', '.join(words)}"


def scale_words(scale: Scale) -> str:
    """
    Say how much was asked for.

    Examples
    --------
    >>> scale_words(Scale(quick=True))
    'quick: few maps, so that small effects do not show; seed 1'
    """
    many = "quick: few maps, so that small effects do not show" if scale.quick else f"up to {scale.maps} maps a cell"
    return f"{many}; seed {scale.seed}"


def rerun(claim: str, scale: Scale) -> str:
    """
    Return the command that checks one claim again, or without its id all of them.

    Examples
    --------
    >>> rerun("C28", Scale(maps=500, seed=7)), rerun("", Scale())
    ('cgla claims C28 --maps 500 --seed 7', 'cgla claims')
    """
    words = ["cgla", "claims", *([claim] if claim else [])]
    if scale.quick:
        words.append("--quick")
    elif scale.maps != Scale().maps:
        words += ["--maps", str(scale.maps)]
    if scale.seed != Scale().seed:
        words += ["--seed", str(scale.seed)]
    return " ".join(words)


def sampled(result: Result) -> str:
    """Say on how many maps a claim's experiments were made, and how many told nothing; empty without any."""
    parts = [f"{name}: {number} maps" for name, number in result.maps.items()]
    parts += [f"{name}: maps that told nothing: {reason}" for name, reason in result.lost.items()]
    return "; ".join(parts)


def results_document(results: Sequence[Result], scale: Scale) -> dict[str, Any]:
    """Return all that is known as one JSON document."""
    return {
        "maps": scale.maps,
        "seed": scale.seed,
        "quick": scale.quick,
        "claims": [
            {
                "id": result.claim.id,
                "place": result.claim.place,
                "sentence": result.claim.sentence,
                "statement": result.claim.statement,
                "kind": result.claim.kind.label,
                "figures": list(result.claim.figures),
                **_labelled(finding_document(result.finding)),
                "maps": dict(result.maps),
                "lost": dict(result.lost),
                "seconds": result.seconds,
                "rerun": rerun(result.claim.id, scale),
            }
            for result in results
        ],
    }


def _labelled(document: dict[str, Any]) -> dict[str, Any]:
    """Write verdicts as people read them."""
    parts = [{**part, "verdict": Verdict[part["verdict"]].label} for part in document["parts"]]
    return {**document, "verdict": Verdict[document["verdict"]].label, "parts": parts}
