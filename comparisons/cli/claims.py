"""The command `claims`: check the claims of the paper."""

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import JsonOption, StudyOptions, Text, option

if TYPE_CHECKING:
    from cgla_graph.comparisons.claims.own import Asked


@dataclass(frozen=True, repr=False, eq=False)
class OwnSettings:
    """Your own settings: named claims run on them, beside the study, never part of it."""

    k: Annotated[Text, option("--k K,K", "risk weights, as 0.5,2: length + K * risk")] = None
    threats: Annotated[Text, option("--threats N,N", "numbers of threats on a map, as 5,20")] = None
    radius: Annotated[Text, option("--radius R,R", "detection radii, map units (the map is 1 wide), as 0.1,0.3")] = None

    def given(self) -> dict[str, str]:
        """Return those that are given."""
        return {name: text for name, text in vars(self).items() if text is not None}

    def refuse_with_list(self) -> None:
        """Refuse settings beside --list, which shows the study."""
        from cgla_graph.errors import CglaError

        if given := self.given():
            msg = f"--list shows the study; leave out --{' and --'.join(given)}, or --list"
            raise CglaError(msg)

    def asked(self, ids: list[str]) -> "Asked":
        """Choose what is run: of a study, or on these settings; say where a study's answers are."""
        from cgla_graph.comparisons.claims import catalogue, own

        given = {name: own.values_of(name, text) for name, text in self.given().items()}
        panel = own.own_panel(**given)
        if given:
            return own.asked_for(ids, panel)
        study = own.Asked(catalogue.chosen(ids), panel)
        if ids:
            console.say(f"cgla: measures now; `cgla claims {' '.join(ids)} --list` prints what the full study found")
        return study


def claims(
    study: StudyOptions,
    settings: OwnSettings,
    ids: Annotated[
        list[str] | None,
        typer.Argument(metavar="ID", help="C28, C17-C19, or a topic of --list (default: all)"),
    ] = None,
    quick: Annotated[
        bool,
        option("--quick", "on a few maps only: 3 minutes instead of 90, with more open answers"),
    ] = False,
    maps: Annotated[int | None, option("--maps N", "maps per cell of the panel (default: 40)", min=1)] = None,
    seed: Annotated[int, option("--seed S", "seed of all random numbers", min=0)] = 1,
    listing: Annotated[
        bool, option("--list", "list the answers of the full study, or only those of the claims named")
    ] = False,
    strict: Annotated[bool, option("--strict", "exit with 1 unless every statement holds")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Check the claims of the paper.

    With --list, prints what the full study found: of claims that are named each statement, else each claim in short.
    Without it, prints an answer for each statement of the paper, measured now, and for up to three claims all the
    evidence; all claims take 90 minutes on two cores. With --out, writes a report (report.html,
    report.md), figures and tables of the paper, the counterexamples, and all numbers (claims.json); measurements are
    saved at once (claims.jsonl), so that an interrupted study can be continued.

    With --k, --threats or --radius, runs the named claims on these settings of your own: the answers stand beside the
    study's, and are never mixed with them.
    """
    if listing:
        settings.refuse_with_list()
        _print_list(ids or [], as_json=as_json)
        return
    from cgla_graph.comparisons.claims import catalogue, command, own, terminal
    from cgla_graph.comparisons.claims.evidence import Scale
    from cgla_graph.errors import CglaError

    if quick and maps is not None:
        msg = "--quick sets the number of maps; leave out --maps or --quick"
        raise CglaError(msg)
    if (study.resume or study.overwrite) and study.out is None:
        msg = f"{'--resume' if study.resume else '--overwrite'} needs the folder of the study (--out)"
        raise CglaError(msg)
    asked = settings.asked(ids or [])
    scale = Scale(Scale().maps if maps is None else maps, seed, quick, asked.panel)
    request = command.Request(
        asked.claims, scale, study.out, study.resume, study.overwrite, scheduler=study.dask, remarks=asked.remarks
    )
    if study.workers is not None:
        request = dataclasses.replace(request, workers=study.workers)
    done = command.check_all(request)
    document = own.document_of(done.results, scale, asked.remarks)
    if as_json:
        console.out_json(document)
    else:
        terminal.print_document(document)
        console.out_files(done.written)
    if done.interrupted:
        kept = f"; continue with --out {study.out} --resume" if study.out else ""
        msg = f"{len(done.results)} of {len(request.claims)} claims are checked{kept}"
        raise console.InterruptedRunError(msg)
    if done.failure is not None:
        console.say(f"cgla: {done.failure}")
    failed = [f"{one.artefact.label} could not be reproduced: {one.failed}" for one in done.shown if one.failed]
    for remark in [*catalogue.remarks(ids or []), *failed]:
        console.say(remark)
    if not done.is_whole or (strict and not done.all_hold):
        raise typer.Exit(console.MISSING)


def _print_list(ids: list[str], *, as_json: bool) -> None:
    """Print what the full study found, by claim, or by statement of those that are named."""
    from cgla_graph.comparisons.claims.summary import listed_claims, listed_statements
    from cgla_graph.comparisons.cli.listings import print_listing

    if ids:
        heads = ["claim", "statement", "answer", "where", "size"]
        print_listing("statements", heads, listed_statements(ids), as_json)
    else:
        print_listing("claims", ["claim", "topic", "sentence", "answers", "settings"], listed_claims(), as_json)
