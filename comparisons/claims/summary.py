"""
The answers of the last full study, as they are shipped, and the pages that show them.

``make claims`` makes both: it checks all claims in full, and quickly under several seeds, then runs this module, which
ships nothing if a quick study says more than the full one, or something else.
"""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.headlines import MADE_FOR, headline_table, rows_of, unanswered
from cgla_graph.comparisons.claims.page import OWN, Document, counted, items, page
from cgla_graph.comparisons.files import write_text
from cgla_graph.errors import ClaimError

#: The file that is shipped, and what of each claim and of each row it holds.
FILE = "verdicts.json"
ENTRIES = ("id", "merged", "topic", "place", "sentence")
ROW_ENTRIES = ("statement", "answer", "basis", "where", "size", "printed")
#: What encloses all answers on a page, or some of them in short.
BEGIN, SHORT = (f"<!-- {words}: written by make claims -->" for words in ("answers", "answers in short"))
END = "<!-- end of answers -->"


def listed_claims() -> list[dict[str, Any]]:
    """
    List the claims with their topics and the answers of the full study, which are shipped.

    Examples
    --------
    >>> listed_claims()[0]["claim"], listed_claims()[0]["topic"]
    ('C1', 'model-of-risk')
    """
    found = []
    for one in shipped_verdicts()["claims"]:
        rows = Counter(row["answer"] for row in one["rows"]).items()
        parts = [f"{count} {answer.removesuffix('s')}" if count > 1 else answer for answer, count in rows]
        found.append(
            {
                "claim": one["id"],
                "topic": catalogue.topic_name(one["topic"]),
                "sentence": one["sentence"],
                "answers": ", ".join(parts),
                "place": one["place"],
                "settings": ", ".join(catalogue.claims()[one["id"]].settings),
            }
        )
    return found


def listed_statements(ids: Sequence[str]) -> list[dict[str, str]]:
    """
    List the statements of some claims with the answers of the full study, which are shipped.

    Raises
    ------
    ClaimError
        If there is no such claim.

    Examples
    --------
    >>> [one["answer"] for one in listed_statements(["C26"]) if one["statement"].startswith("length")][0]
    'holds'
    """
    wanted = {claim.id for claim in catalogue.chosen(ids)}
    return [
        {"claim": one["id"], **{entry: row[entry] for entry in ("statement", "answer", "where", "size")}}
        for one in shipped_verdicts()["claims"]
        if one["id"] in wanted
        for row in one["rows"]
    ]


def shipped_verdicts() -> dict[str, Any]:
    """Return the answers that are shipped: scale, and for each claim the `ENTRIES` and its rows."""
    return _read(Path(__file__).with_name(FILE))


def shortened(document: Document) -> dict[str, Any]:
    """
    Leave of what `cgla claims --json` prints what is shipped.

    Raises
    ------
    ClaimError
        If it is not a full study of all claims, is of a user's own settings, or an answer is missing.
    """
    _require_study(document)
    is_all = [claim["id"] for claim in document["claims"]] == list(catalogue.claims())
    if document["quick"] or document["maps"] < Scale().maps or not is_all:
        msg = f"this is no full study of all claims: run cgla claims --out DIR, on at least {Scale().maps} maps a cell"
        raise ClaimError(msg)
    missing = [what for what, row in rows_of(document).items() if row["answer"] == Answer.MISSING.label]
    if missing or (missing := unanswered(document)):
        msg = f"there is no answer to {'; '.join(map(', '.join, missing))}"
        raise ClaimError(msg)
    claims = [
        {**{name: claim[name] for name in ENTRIES}, "rows": [{n: row[n] for n in ROW_ENTRIES} for row in claim["rows"]]}
        for claim in document["claims"]
    ]
    return {**{name: document[name] for name in ("maps", "seed", "quick")}, "claims": claims}


def contradictions(full: Document, quick: Document) -> list[str]:
    """List the statements of which a quick study says something else than the full one, unless that they are open."""
    _require_study(full, quick)
    own, others = ({what: row["answer"] for what, row in rows_of(one).items()} for one in (full, quick))
    return [
        f"{', '.join(what)}: {others.get(what)} with --quick --seed {quick['seed']}, {own.get(what)} in full"
        for what in own | others
        if others.get(what) != own.get(what) and (others.get(what) != Answer.OPEN.label or what not in own)
    ]


def with_answers(text: str, document: Document) -> str:
    """
    Put the answers between the two marks of a page: all of them, or in short.

    Raises
    ------
    ClaimError
        If it does not have a first mark and the `END`, once each, or the answers are of a user's own settings.
    """
    _require_study(document)
    mark = next((one for one in (BEGIN, SHORT) if text.count(one) == text.count(END) == 1), None)
    if mark is None:
        msg = f"the page needs {BEGIN} or {SHORT}, and {END}, once each"
        raise ClaimError(msg)
    before, _, rest = text.partition(mark)
    said = "\n\n".join(["", *page(document, index=True), ""]) if mark == BEGIN else f"\n{_short(document)}\n"
    return f"{before}{mark}{said}{END}{rest.partition(END)[2]}"


def _short(document: Document) -> str:
    """Write how many statements have which answer, and what the toolkit was made to answer."""
    links = "[all of them](docs/claims.md), [readings](docs/readings.md)"
    said = [f"{question} {answer} ({size})" for question, answer, size in headline_table(document, MADE_FOR).rows]
    return "\n".join([f"- {counted(document)} ({links})", items(said)])


def rewrite(*pages: Path) -> None:
    """Write the shipped answers onto pages again, as where their words or their order changed."""
    for path in pages:
        write_text(path, with_answers(path.read_text(encoding="utf-8"), shipped_verdicts()))


def main(claims: Path, *others: Path) -> None:
    """
    Take the answers of a study (``claims.json``) over into what is shipped, and onto pages (``.md``).

    Other files are what ``cgla claims --quick --json`` printed. Without a study, pages show what is shipped.

    Raises
    ------
    ClaimError
        If it is no full study, or a quick one says something else.
    """
    if claims.suffix == ".md":
        rewrite(claims, *others)
        return
    document = shortened(_read(claims))
    studies = [_read(path) for path in others if path.suffix == ".json"]
    if found := [words for study in studies for words in contradictions(document, study)]:
        msg = f"a quick study has to say the same as the full one, or that it is open: {'; '.join(found)}"
        raise ClaimError(msg)
    document["quick_seeds"] = [study["seed"] for study in studies]
    pages = {path: with_answers(path.read_text(encoding="utf-8"), document) for path in others if path.suffix == ".md"}
    write_text(Path(__file__).with_name(FILE), json.dumps(document, ensure_ascii=False, indent=1) + "\n")
    for path, text in pages.items():
        write_text(path, text)


def _require_study(*documents: Document) -> None:
    """Refuse what was found on a user's own settings: it is never mixed with the answers of the study."""
    for one in documents:
        if OWN in one:
            words = "; ".join(f"{name} {', '.join(map(str, levels))}" for name, levels in one[OWN].items())
            msg = f"these claims were run on a user's own settings ({words}): only a study's answers are shipped"
            raise ClaimError(msg)


def _read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:]))
