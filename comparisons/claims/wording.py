"""Findings in words, the same in the terminal, in the report and in the manual; and all of them as one document."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import Entry, Part, Verdict, finding_document
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
    """Count the verdicts of all parts, in the order in which they are defined, without those that do not occur."""
    found = Counter(part.verdict for result in results for part in result.finding.parts)
    return {verdict: found[verdict] for verdict in Verdict if found[verdict]}


def counted(results: Sequence[Result]) -> str:
    """Say in one line how many parts of the claims got which verdict."""
    found = counts(results)
    words = ", ".join(f"{number} {verdict.label}" for verdict, number in found.items())
    return f"{how_many(len(results), sum(found.values()))}: {words}"


def part_words(part: Part) -> str:
    """
    Write all that is known of a part in one paragraph.

    Examples
    --------
    >>> part_words(Part("risk", Verdict.SUPPORTED, "in 12 of 12 cells", effect="0.21", printed="0.24"))
    'risk: supported; in 12 of 12 cells; 0.21 (paper: 0.24)'
    """
    return "; ".join(filter(None, [part.ruling, part.result, part.sizes]))


def how_many(claims: int, parts: int) -> str:
    """
    Say how many claims there are, and how many things they say.

    Examples
    --------
    >>> how_many(1, 1), how_many(54, 90)
    ('1 claim', '54 claims, which say 90 things')
    """
    words = f"{claims} claim{'' if claims == 1 else 's'}"
    return words if parts == claims else f"{words}, which say{'s' if claims == 1 else ''} {parts} things"


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
                "verdict": ", ".join(verdict.label for verdict in result.finding.verdicts),
                "headline": result.finding.headline,
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
    labelled = {
        name: [{**part, "verdict": Verdict[part["verdict"]].label} for part in document[name]]
        for name in ("parts", "beside")
    }
    return {**document, **labelled}
