"""
The verdicts of the last full study, as they are shipped, and the table of them in the manual.

``make claims`` makes both: it checks all claims in full, and quickly under several seeds, then runs this module, which
ships nothing if a quick check contradicts the full one.
"""

import json
import sys
from collections import Counter
from importlib import resources
from pathlib import Path
from typing import Any

from cgla_graph.comparisons.claims.claim import Finding, Part, Verdict
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.wording import how_many, scale_words
from cgla_graph.comparisons.files import write_text
from cgla_graph.errors import ClaimError

#: The file that is shipped, and what of each claim it holds.
FILE = "verdicts.json"
ENTRIES = ("id", "place", "kind", "sentence", "headline", "result")
#: What of each part.
PART_ENTRIES = ("statement", "verdict", "condition", "effect", "printed", "levels")
#: The paper's claims, all told.
N_CLAIMS = 54
#: What encloses the table on its page.
BEGIN, END = "<!-- verdicts: written by make claims -->", "<!-- end of verdicts -->"


def shipped_verdicts() -> dict[str, Any]:
    """
    Return the verdicts that are shipped: scale, version, and for each claim the `ENTRIES`.

    Examples
    --------
    >>> len(shipped_verdicts()["claims"])
    54
    """
    text = (resources.files("cgla_graph.comparisons.claims") / FILE).read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def shortened(document: dict[str, Any]) -> dict[str, Any]:
    """
    Leave of what `cgla claims --json` prints what is shipped.

    Raises
    ------
    ClaimError
        If it is not a full study of all claims: what is shipped is never a sample of it.
    """
    claims = document["claims"]
    missing = [claim["id"] for claim in claims for part in claim["parts"] if part["verdict"] == "missing"]
    if document["quick"] or document["maps"] < Scale().maps or missing or len(claims) < N_CLAIMS:
        msg = "this is no full study of all claims: run cgla claims --out DIR without --quick, on at least 200 maps"
        raise ClaimError(msg)
    kept = [
        {
            **{name: claim[name] for name in ENTRIES},
            "parts": [{name: part[name] for name in PART_ENTRIES} for part in claim["parts"]],
        }
        for claim in claims
    ]
    return {"maps": document["maps"], "seed": document["seed"], "claims": kept}


def contradictions(full: dict[str, Any], quick: dict[str, Any]) -> list[str]:
    """
    List where a quick study says something else than the full one, other than that it is undecided.

    Examples
    --------
    >>> said = [{"statement": "risk", "verdict": "supported"}, {"statement": "length", "verdict": "undecided"}]
    >>> less = [{"statement": "risk", "verdict": "undecided"}, {"statement": "length", "verdict": "supported"}]
    >>> full, quick = ({"seed": 1, "claims": [{"id": "C32", "parts": parts}]} for parts in (said, less))
    >>> contradictions(full, quick)
    ['C32, length: supported with --quick --seed 1, undecided in full']
    """
    quickly = {claim["id"]: _said(claim) for claim in quick["claims"]}
    found = []
    for claim in full["claims"]:
        ours, others = _said(claim), quickly[claim["id"]]
        if ours.keys() != others.keys():
            found.append(f"{claim['id']}: says other things with --quick --seed {quick['seed']} than in full")
            continue
        found += [
            f"{claim['id']}, {' '.join(filter(None, what)) or 'the sentence'}: {verdict} with --quick --seed "
            f"{quick['seed']}, {ours[what]} in full"
            for what, verdict in others.items()
            if verdict not in {ours[what], Verdict.UNDECIDED.label}
        ]
    return found


def _said(claim: dict[str, Any]) -> dict[tuple[str, ...], str]:
    """Return the verdict of each thing that is said, and of each level of a factor: groups of levels may differ."""
    found: dict[tuple[str, ...], str] = {}
    for part in claim["parts"]:
        for level in part.get("levels") or ("",):
            what: tuple[str, ...] = (part["statement"], level)
            while what in found:
                # the same statement under another condition
                what = (*what, "again")
            found[what] = part["verdict"]
    return found


def counted(document: dict[str, Any]) -> str:
    """
    Count the verdicts of all parts, the most frequent first.

    Examples
    --------
    >>> claims = [{"parts": [{"verdict": "proved"}]}, {"parts": [{"verdict": "refuted"}, {"verdict": "proved"}]}]
    >>> counted({"claims": claims})
    '2 proved, 1 refuted'
    """
    counts = Counter(part["verdict"] for claim in document["claims"] for part in claim["parts"])
    return ", ".join(f"{number} {verdict}" for verdict, number in counts.most_common())


def verdict_table(document: dict[str, Any]) -> str:
    """
    Write the table of the manual from what is shipped.

    Parameters
    ----------
    document
        As `shipped_verdicts` returns it.

    Returns
    -------
    text
        Markdown: the lines between the two marks.
    """
    scale, claims = Scale(document["maps"], document["seed"]), document["claims"]
    counts = how_many(len(claims), sum(len(claim["parts"]) for claim in claims))
    lines = [
        f"{counts} ({scale_words(scale)}): {counted(document)}.",
        "",
        "| claim | what the paper says | verdict, condition | effect here (in the paper) |",
        "|---|---|---|---|",
        *(
            f"| {claim['id']} | {_cell(claim['sentence'])} | {_cell(claim['headline'])} | {_cell(_effects(claim))} |"
            for claim in claims
        ),
    ]
    return "\n".join(lines)


def _effects(claim: dict[str, Any]) -> str:
    """Say how large things are, beside the paper's own sizes."""
    parts = [Part(one["statement"], Verdict.MISSING, "", "", one["effect"], one["printed"]) for one in claim["parts"]]
    return Finding(tuple(parts), "").sizes


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())


def with_table(page: str, document: dict[str, Any]) -> str:
    """
    Put the table between the two marks of a page.

    Raises
    ------
    ClaimError
        If it does not have both marks, once each.
    """
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        msg = f"the page needs the lines {BEGIN} and {END}, once each"
        raise ClaimError(msg)
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{verdict_table(document)}\n{END}{after}"


def main(claims: Path, page: Path, *quick: Path) -> None:
    """
    Take the verdicts of a study over into what is shipped, and onto its page.

    Raises
    ------
    ClaimError
        If it is no full study, or a quick one contradicts it.
    """
    document = shortened(_read(claims))
    studies = [_read(path) for path in quick]
    found = [words for study in studies for words in contradictions(document, study)]
    if found:
        msg = f"a quick check has to say the same as the full study, or be undecided: {'; '.join(found)}"
        raise ClaimError(msg)
    document["quick_seeds"] = [study["seed"] for study in studies]
    write_text(Path(__file__).with_name(FILE), json.dumps(document, ensure_ascii=False, indent=1) + "\n")
    write_text(page, with_table(page.read_text(encoding="utf-8"), document))


def _read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:]))
