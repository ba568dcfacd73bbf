"""
The verdicts of the last full study, as they are shipped, and the table of them in the manual.

``make claims`` makes both: it checks all claims in full, then runs this module.
"""

import json
import sys
from collections import Counter
from importlib import resources
from pathlib import Path
from typing import Any

from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.wording import scale_words
from cgla_graph.comparisons.files import write_text
from cgla_graph.errors import ClaimError

#: The file that is shipped, and what of each claim it holds.
FILE = "verdicts.json"
ENTRIES = ("id", "place", "kind", "sentence", "verdict", "result")
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
    missing = [claim["id"] for claim in claims if claim["verdict"] == "missing"]
    if document["quick"] or document["maps"] < Scale().maps or missing or len(claims) < N_CLAIMS:
        msg = "this is no full study of all claims: run cgla claims --out DIR without --quick, on at least 200 maps"
        raise ClaimError(msg)
    kept = [{name: claim[name] for name in ENTRIES} for claim in claims]
    return {"maps": document["maps"], "seed": document["seed"], "claims": kept}


def counted(document: dict[str, Any]) -> str:
    """
    Count the verdicts, the most frequent first.

    Examples
    --------
    >>> counted({"claims": [{"verdict": "proved"}, {"verdict": "refuted"}, {"verdict": "proved"}]})
    '2 proved, 1 refuted'
    """
    counts = Counter(claim["verdict"] for claim in document["claims"])
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
    scale = Scale(document["maps"], document["seed"])
    lines = [
        f"{len(document['claims'])} claims ({scale_words(scale)}): {counted(document)}.",
        "",
        "| claim | what the paper says | verdict |",
        "|---|---|---|",
        *(f"| {claim['id']} | {_cell(claim['sentence'])} | {claim['verdict']} |" for claim in document["claims"]),
    ]
    return "\n".join(lines)


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


def main(claims: Path, page: Path) -> None:
    """Take the verdicts of a study over into what is shipped, and onto its page."""
    document = shortened(json.loads(claims.read_text(encoding="utf-8")))
    write_text(Path(__file__).with_name(FILE), json.dumps(document, ensure_ascii=False, indent=1) + "\n")
    write_text(page, with_table(page.read_text(encoding="utf-8"), document))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
