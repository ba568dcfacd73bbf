"""Claims on a user's own settings (K, numbers of threats, detection radius), beside the study and never part of it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cgla_graph._text import counted, listed, shown
from cgla_graph._validate import real_number
from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import Claim, Setting, Table
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.page import HEADS, Document, cells_of, grid, items, results_document
from cgla_graph.comparisons.claims.panel.settings import FACTORS, Panel
from cgla_graph.comparisons.claims.rule import RULE
from cgla_graph.comparisons.claims.summary import shipped_verdicts
from cgla_graph.comparisons.tables.markdown import plain
from cgla_graph.errors import ClaimError, ProblemError

#: What may be given of each setting: the least and the greatest value, and whether only whole numbers. Beyond the
#: greatest K length is lost beside the rounding of risk; a radius is at least a step, and with 1.3 all is seen.
ALLOWED: Mapping[str, tuple[float, float, bool]] = {
    "k": (0.0, 1e6, False),
    "threats": (1, 100, True),
    "radius": (0.02, 1.3, False),
}
#: More values of one setting are refused: every value multiplies the flights.
MOST_VALUES = 10
#: What is said of the answers.
NO_VERDICTS = (
    "These answers are of your own settings. They are no verdicts on the paper, and the study's answers, which stand "
    "under each claim, do not change by them."
)


def own_panel(k: object = None, threats: object = None, radius: object = None) -> Panel:
    """
    Return the panel with a user's own levels.

    Parameters
    ----------
    k, threats, radius
        A number or several: risk weights, numbers of threats, detection radii (map units). None for the study's.

    Raises
    ------
    ProblemError
        If one is not as `ALLOWED`.

    Examples
    --------
    >>> own_panel(k=[2, 0.5], threats=5).own
    {'k': (0.5, 2.0), 'threats': (5,)}
    """
    given = {"k": k, "threats": threats, "radius": radius}
    return Panel({name: _levels(name, values) for name, values in given.items() if values is not None})


def values_of(name: str, text: str) -> list[float]:
    """
    Read the values of an option, as ``0.5,2``.

    Raises
    ------
    ProblemError
        If one is no number.

    Examples
    --------
    >>> values_of("k", "0.5,2")
    [0.5, 2.0]
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise _refused(name, text) from None


def _levels(name: str, values: Any) -> tuple[float, ...]:  # noqa: ANN401 - a number, or several
    is_one = isinstance(values, str | bytes) or getattr(values, "ndim", 1) == 0 or not hasattr(values, "__iter__")
    given = [values] if is_one else list(values)
    least, most, is_whole = ALLOWED[name]
    found: set[float] = set()
    for value in given:
        number = real_number(value)
        if not least <= number <= most or (is_whole and number != math.floor(number)):
            raise _refused(name, value)
        # of -0.0, 0.0
        found.add(int(number) if is_whole else number + 0.0)
    if not 1 <= len(found) <= MOST_VALUES:
        raise _refused(name, given)
    return tuple(sorted(found))


def _refused(name: str, value: object) -> ProblemError:
    least, most, is_whole = ALLOWED[name]
    kind = "whole numbers" if is_whole else "numbers"
    unit = " in map units, where the map is 1 wide" if name == "radius" else ""
    msg = f"{name} is {shown(value)}; give 1 to {MOST_VALUES} {kind} from {least:g} to {most:g}{unit}"
    return ProblemError(f"{msg} ({_AS[name]})")


_AS = {"k": "as 0.5,2", "threats": "as 5,20", "radius": "as 0.1,0.3"}


@dataclass(frozen=True)
class Asked:
    """
    What is run on own settings.

    Attributes
    ----------
    claims, panel
        The claims that have at least one of the settings, and the settings.
    remarks
        Of each claim without one of the settings, which it has, and whether it is run.
    """

    claims: Sequence[Claim]
    panel: Panel
    remarks: Sequence[str] = field(default=())


def asked_for(names: Sequence[str], panel: Panel) -> Asked:
    """
    Choose the claims that have the settings.

    Parameters
    ----------
    names
        Ids and topics, as of `catalogue.chosen`.
    panel
        With a user's own levels.

    Raises
    ------
    ClaimError
        If no claim is named, there is no such claim, or none of them has one of the settings.

    Examples
    --------
    >>> asked_for(["C25"], own_panel(k=2, radius=0.3)).remarks
    ('C25 has no radius, and is run without it: it has k and threats',)
    """
    if not panel.own:
        msg = f"give at least one setting: {', '.join(ALLOWED)}"
        raise ClaimError(msg)
    if not names:
        msg = "name the claims to run on your own settings, as C26 or eight-directions (cgla claims --list)"
        raise ClaimError(msg)
    claims, remarks = [], []
    for claim in catalogue.chosen(names):
        lacking = [name for name in panel.own if name not in claim.settings]
        few = [name for name in panel.own if name not in lacking and len(panel.own[name]) < claim.settings[name].least]
        is_run = len(lacking) < len(panel.own) and not few
        claims += [claim] if is_run else []
        if few:
            least = claim.settings[few[0]].least
            remedy = f"give {least} or more ({_AS[few[0]]})"
            remarks.append(f"{claim.id} compares values of {few[0]}, and is not run: {remedy}")
        elif lacking:
            done = f"and is run without {'it' if len(lacking) == 1 else 'them'}" if is_run else "and is not run"
            remarks.append(f"{claim.id} has no {' and no '.join(lacking)}, {done}: {_has(claim)}")
    if not claims:
        raise ClaimError("; ".join(remarks))
    return Asked(claims, panel, tuple(remarks))


def _has(claim: Claim) -> str:
    if claim.settings:
        return f"it has {listed(list(claim.settings))}"
    return "it has none of " + listed(list(ALLOWED)) + ", as no random map or flight decides it"


def own_document(results: Sequence[Result], scale: Scale, remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Return what was found on own settings as one JSON document, with the study's rows beside each claim."""
    document = results_document(results, scale)
    study = shipped_verdicts()
    rows = {one["id"]: one["rows"] for one in study["claims"]}
    for one, result in zip(document["claims"], results, strict=True):
        settings = result.claim.settings
        one["settings"] = {name: _setting(name, setting, scale.panel) for name, setting in settings.items()}
        scope = {name: study[name] for name in ("maps", "seed")}
        one["study"] = {**scope, "rows": rows.get(one["id"], [])}
    return {**document, "note": NO_VERDICTS, "remarks": list(remarks)}


def document_of(results: Sequence[Result], scale: Scale, remarks: Sequence[str] = ()) -> dict[str, Any]:
    """Return what was found as one JSON document: of a study, or on a user's own settings."""
    return own_document(results, scale, remarks) if scale.panel.own else results_document(results, scale)


def _setting(name: str, setting: Setting, panel: Panel) -> dict[str, Any]:
    usual = list(setting.usual or FACTORS[name])
    is_own = name in panel.own
    values = list(panel.own[name]) if is_own else usual
    return {"values": values, "own": is_own, "study": usual, "means": setting.means}


def paragraphs(document: Document, *, with_evidence: bool = True) -> Iterator[str]:
    """Yield what was found on own settings: of each claim the settings, answers, the study's answers, and evidence."""
    yield "## On your own settings"
    yield plain(NO_VERDICTS)
    many = "few maps (`--quick`)" if document["quick"] else f"{counted(document['maps'], 'map')} of each kind"
    yield f"{many}, seed {document['seed']}. Sizes: the middle cell (least to greatest cell), then all maps with 95 %."
    for claim in document["claims"]:
        yield from _claim(claim)
        yield from _evidence(claim) if with_evidence else ()
    if document["remarks"]:
        yield items(document["remarks"])
    yield plain(RULE)


def _claim(claim: Document) -> Iterator[str]:
    yield f"### {claim['id']} ({plain(claim['place'])}): {plain(claim['sentence'])}"
    rows = [
        (name, _words(one["values"]) if one["own"] else "as in the study", _words(one["study"]), one["means"])
        for name, one in claim["settings"].items()
    ]
    yield grid(Table("", ("setting", "yours", "in the study", "means"), rows))
    yield "#### On your settings"
    heads = (*HEADS[1:5], "all maps")
    yield grid(Table("", heads, [(*cells_of(row)[:4], row["interval"]) for row in claim["rows"]]))
    study = claim["study"]
    yield f"#### In the study ({study['maps']} maps of each kind, seed {study['seed']})"
    yield grid(Table("", HEADS[1:], [cells_of(row) for row in study["rows"]]))


def _evidence(claim: Document) -> Iterator[str]:
    if claim["tables"]:
        yield "#### Evidence on your settings"
    yield from (grid(Table(one["title"], one["columns"], one["rows"], one["note"])) for one in claim["tables"])
    lost = [f"{name}: maps that told nothing: {reason}" for name, reason in claim["lost"].items()]
    sampled = [f"{name}: {number} maps" for name, number in claim["maps"].items()]
    yield plain("; ".join([f"Again: `{claim['rerun']}`", *sampled, *lost]))


def _words(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
