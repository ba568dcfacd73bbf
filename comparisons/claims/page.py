"""What a study of claims found: one document, and the Markdown that manual, report and terminal are made of."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from cgla_graph._text import counted as n_of
from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import Answer, Basis, Table, finding_document
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.headlines import headline_table
from cgla_graph.comparisons.claims.panel import settings
from cgla_graph.comparisons.claims.panel.company import CONSTANTS as OF_TEAMS
from cgla_graph.comparisons.claims.panel.single_uav import CONSTANTS
from cgla_graph.comparisons.claims.rule import RULE, part_name
from cgla_graph.comparisons.tables.markdown import markdown_table, plain

#: What is known: of the study, and of each claim.
Document: TypeAlias = Mapping[str, Any]

#: Bases that stand beside an answer; the others are flights and random instances.
_SAID = {Basis.PROOF.label, Basis.COUNTEREXAMPLE.label}
#: The entry that marks a document of claims on a user's own settings, which is no study.
OWN = "own_settings"
#: Columns of statements.
HEADS = ("claim", "statement", "answer", "where", "size", "in the paper")
#: What a reader has to know beside the panel and the rule.
ABOUT = (
    "The paper prints neither its maps nor the detection radius: random maps stand for them.",
    "Risk is the exact line integral of F; ratios of the paper's sum of F, each 0.02, differ by less than 1 %.",
    "Planners with `-style` in their names are written after descriptions: they are not the originals.",
)


def results_document(results: Sequence[Result], scale: Scale) -> dict[str, Any]:
    """Return everything that is known as one JSON document."""
    titles = {claim.id: title for title, of in catalogue.topics().items() for claim in of}
    said = [(result, result.claim) for result in results]
    claims = [
        {
            "id": claim.id,
            "merged": [f"C{number}" for number in claim.merged],
            "topic": titles[claim.id],
            **{name: getattr(claim, name) for name in ("place", "sentence", "reads")},
            "figures": list(claim.figures),
            **finding_document(result.finding),
            "maps": dict(result.maps),
            "lost": dict(result.lost),
            "seconds": result.seconds,
            "rerun": rerun(claim.id, scale),
        }
        for result, claim in said
    ]
    how = {"maps": scale.maps, "seed": scale.seed, "quick": scale.quick}
    own = {name: list(levels) for name, levels in scale.panel.own.items()}
    return {**({OWN: own} if own else {}), **how, "claims": claims}


def rerun(claim: str, scale: Scale) -> str:
    """
    Return the command that checks one claim again, or without its id all of them.

    Examples
    --------
    >>> rerun("C28", Scale(maps=500, seed=7)), rerun("", Scale())
    ('cgla claims C28 --maps 500 --seed 7', 'cgla claims')
    """
    maps = ["--quick"] if scale.quick else [] if scale.maps == Scale().maps else ["--maps", str(scale.maps)]
    seed = [] if scale.seed == Scale().seed else ["--seed", str(scale.seed)]
    levels = {name: [repr(one).removesuffix(".0") for one in of] for name, of in scale.panel.own.items()}
    own = [f"--{name} {','.join(of)}" for name, of in levels.items()]
    return " ".join(["cgla", "claims", *([claim] if claim else []), *own, *maps, *seed])


def counted(document: Document) -> str:
    """Count claims, statements and answers."""
    found = Counter(row["answer"] for claim in document["claims"] for row in claim["rows"])
    words = ", ".join(f"{answer.label} {found[answer.label]}" for answer in Answer if found[answer.label])
    sentences = n_of(len(document["claims"]), "sentence")
    return f"{sentences} of the paper in {n_of(found.total(), 'statement')}: {words}"


def grid(table: Table) -> str:
    """Write a table with its title and its note, without columns that are empty; nothing if it has no rows."""
    if not table.rows:
        return ""
    kept = [column for column in range(len(table.columns)) if any(row[column] != "" for row in table.rows)]
    rows = [[row[column] for column in kept] for row in table.rows]
    lines = markdown_table([table.columns[column] for column in kept], rows)
    return "\n\n".join(filter(None, [table.title and f"{plain(table.title)}:", lines, plain(table.note)]))


def items(texts: Iterable[str]) -> str:
    """Write a list."""
    return "\n".join(f"- {plain(text)}" for text in texts)


def page(document: Document, *, index: bool = False) -> Iterator[str]:
    """Yield the paragraphs of the page: what users ask, all statements by topic (with an index), panel and rule."""
    many = "few maps (`--quick`)" if document["quick"] else f"{document['maps']} maps a cell"
    yield "## Ten answers"
    yield grid(headline_table(document))
    yield "A size is that of the middle cell of the panel, with the least and the greatest of all cells in brackets."
    yield f"{counted(document)} ({many}, seed {document['seed']})."
    yield "## All statements"
    if index:
        yield from topic_index(document)
    yield "A row in bold is a sentence of the paper, in our words; its statements follow, a line each."
    yield from statements(document)
    yield "## Panel and rule"
    yield from panel(document)


def statements(document: Document) -> Iterator[str]:
    """Yield a table for each topic, with a row for the sentence of each claim and one for each of its statements."""
    for title, claims in topics(document):
        yield f"### {title}"
        rows: list[Sequence[str]] = []
        for claim in claims:
            name = ", ".join([f"**{claim['id']}**", *claim["merged"]])
            place = claim["place"].replace("Section ", "§")
            rows.append((name, f"**{claim['sentence']}** ({place})", "", "", "", ""))
            rows += [("", *cells_of(row)) for row in claim["rows"]]
        yield grid(Table("", HEADS, rows))


def topic_index(document: Document) -> Iterator[str]:
    """Yield the topics with their claims, and what a user can set of each."""
    rows = []
    for title, claims in topics(document):
        by_settings: dict[str, list[str]] = {}
        for claim in claims:
            words = ", ".join(f"`--{name}`" for name in catalogue.claims()[claim["id"]].settings)
            by_settings.setdefault(words, []).append(claim["id"])
        said = "; ".join(f"{', '.join(ids)}: {words}" for words, ids in by_settings.items() if words)
        anchor = re.sub(r"[^a-z0-9]+", "-", title.lower())
        ids = ", ".join(claim["id"] for claim in claims)
        rows.append((f"[{title}](#{anchor})", ids, f"`cgla claims {catalogue.topic_name(title)}`", said))
    yield "A topic is a name for the command; the settings of your own that its claims take are in the last column."
    yield grid(Table("", ("topic", "claims", "command", "settings"), rows))


def topics(document: Document) -> list[tuple[str, list[Document]]]:
    """Group the claims of a document by topic, in the order of the page."""
    titles = dict.fromkeys([*catalogue.TOPICS.values(), *(claim["topic"] for claim in document["claims"])])
    found = [(title, [claim for claim in document["claims"] if claim["topic"] == title]) for title in titles]
    return [(title, claims) for title, claims in found if claims]


def cells_of(row: Document) -> tuple[str, ...]:
    """Return the entries of a statement, under `HEADS` without the claim."""
    basis = f" ({row['basis']})" if row["basis"] in _SAID else ""
    return row["statement"], f"{row['answer']}{basis}", row["where"], row["size"], row["printed"]


def panel(document: Document) -> Iterator[str]:
    """Yield how answers were found: the panel and the rule, from the constants that the checks use."""
    factors = {
        "threats": settings.FACTORS["threats"],
        "spreads of threats": [f"{name} {low:g} to {high:g}" for name, (low, high) in settings.SPREADS.items()],
        "goal": [f"{name} {goal}" for name, goal in settings.GOALS.items()],
        "detection radius (OR)": settings.FACTORS["radius"],
        "risk weight K": settings.FACTORS["k"],
    }
    rows = [(what, ", ".join(str(level).removesuffix(".0") for level in levels)) for what, levels in factors.items()]
    yield "Flights are judged on one panel, declared before its maps were drawn. Lengths are in map units."
    yield grid(Table("", ("factor", "levels"), rows))
    seeds = [settings.seeds_of(kind, document["seed"], document["maps"]) for kind in settings.KINDS]
    bases = "; ".join(part_name(tuple(base.items())) for base in settings.BASES)
    left_out = "; ".join(f"C{number} ({why})" for number, why in catalogue.LEFT_OUT.items())
    said = [
        f"{len(settings.cells())} cells; {document['maps']} maps of each kind, seeds {seeds[0][0]} to {seeds[-1][-1]}.",
        *([] if document["quick"] else _fewer(document["maps"])),
        f"Varied one at a time, for every K, from three cells ({bases}): {_varied()}.",
        "Outside of these ranges nothing is known: other threats, radii or K may change an answer.",
        RULE,
        *ABOUT,
        *(f"**{one.label}**: {one.value}." for one in (Answer.NOT_REPRODUCED, Answer.NOT_TESTABLE)),
        f"Left out: {left_out}.",
    ]
    yield items(said)


def _fewer(maps: int) -> Iterator[str]:
    """Name the claims that are tested on fewer maps, as a map takes long."""
    found: dict[int, list[str]] = {}
    for claim in catalogue.claims().values():
        counts = [catalogue.experiments()[name].count(maps) for name in claim.experiments]
        if min(counts, default=maps) < maps:
            found.setdefault(min(counts), []).append(claim.id)
    words = [f"{count} of each kind for {', '.join(ids)}" for count, ids in sorted(found.items())]
    if words:
        yield f"Fewer maps, where flights take long: {'; '.join(words)}."


def _varied() -> str:
    """Name the settings that are varied, each with its values."""
    found = {name: [value] for name, value in settings.RULES.items()}
    for (planner, _), (_, changed) in (*CONSTANTS, *OF_TEAMS):
        name, value = changed[-1]
        found.setdefault(f"{planner} {name}", []).append(f"{value:g}" if isinstance(value, float) else str(value))
    return "; ".join(f"{name} {', '.join(dict.fromkeys(values))}" for name, values in found.items())


def evidence(claim: Document) -> Iterator[str]:
    """Yield all that is known of a claim."""
    yield f"### {claim['id']} ({plain(claim['place'])}): {plain(claim['sentence'])}"
    yield grid(Table("", (*HEADS[1:], "why"), [(*cells_of(row), row["why"]) for row in claim["rows"]]))
    yield plain(f"It reads: {claim['reads']}")
    if claim["notes"] or claim["tables"]:
        yield "#### Evidence"
        yield items(claim["notes"])
        yield from (grid(Table(one["title"], one["columns"], one["rows"], one["note"])) for one in claim["tables"])
    sampled = [f"{name}: {number} maps" for name, number in claim["maps"].items()]
    sampled += [f"{name}: maps that told nothing: {reason}" for name, reason in claim["lost"].items()]
    said = {
        "Again": f"`{claim['rerun']}`",
        "Sample": "; ".join(sampled),
        "Counterexamples": ", ".join(f"`{name}`" for name in claim["counterexamples"]),
        "See": ", ".join(claim["figures"]),
        "Parts of it": ", ".join(claim["merged"]),
    }
    yield plain(" ".join(f"{what}: {text}." for what, text in said.items() if text))
