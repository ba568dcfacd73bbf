"""The commands `conform` and `answer`: compare a planner in any language with proven optima."""

import math
from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import JsonOption, RefineOption, SolverOption, option


def conform(
    planner: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="-- COMMAND | verify [FOLDER] | prove FOLDER",
            help="a planner: reads a problem as JSON, writes a path as JSON; or what to do with proof files",
        ),
    ] = None,
    instances: Annotated[str | None, option("--instances A,B", "names or families of instances (default: all)")] = None,
    timeout: Annotated[float, option("--timeout S", "time limit of an instance, seconds")] = 60.0,
    memory: Annotated[float, option("--memory MB", "memory limit of each process of the planner, megabytes")] = 4096.0,
    tolerance: Annotated[
        float | None, option("--tolerance R", "exit with 1 if a path costs more than this above the best known")
    ] = None,
    workers: Annotated[int, option("--workers N", "instances at a time, which share the cores", min=1)] = 1,
    out: Annotated[Path | None, option("--out FILE.json", "write the results to a file")] = None,
    as_list: Annotated[bool, option("--list", "list the instances and exit")] = False,
    show: Annotated[str | None, option("--show NAME", "print the problem of an instance as planners read it")] = None,
    schema: Annotated[bool, option("--schema", "print the JSON schemas of problems and answers")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Measure any planner, in any language, against optima that are proven to 0.5 %.

    Runs COMMAND once per instance: it reads a problem on standard input and writes a path on standard output, both as
    JSON. Each path is evaluated here (problem.evaluate); the table shows how far it is from the best possible. If a
    planner hangs, crashes, writes too much or reports a wrong cost, its row says so. Exits with 1 unless all answers
    are right.

    cgla conform verify checks the proof files of the suite's bounds: those that are stored, and those in FOLDER, which
    cgla conform prove FOLDER writes. (A planner of that name is ./verify.)
    """
    from cgla_graph._validate import non_negative_number
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.conformance import report as suite

    if as_list or show is not None or schema:
        _show_conformance(show, schema=schema, as_json=as_json)
        return
    if planner and planner[0] in {"verify", "prove"}:
        _proofs(planner, instances, as_json=as_json)
        return
    allowed = math.inf if tolerance is None else non_negative_number("--tolerance", tolerance)
    command, asked = planner or [], suite.picked(instances)
    if out is not None:
        files.make_folder(out.parent)
    results = suite.run_suite(command, asked, seconds=timeout, megabytes=memory, workers=workers)
    found = suite.document(command, asked, results, seconds=timeout, tolerance=allowed)
    if out is not None:
        files.write_text(out, console.json_text(found))
    if as_json:
        console.out_json(found)
    else:
        suite.print_results(results, allowed)
        console.out_files([] if out is None else [out])
    if len(results) < len(asked):
        msg = f"{len(results)} of {len(asked)} instances are done"
        raise console.InterruptedRunError(msg)
    if not suite.passes(results, allowed):
        raise typer.Exit(console.MISSING)


def _proofs(words: list[str], names: str | None, *, as_json: bool) -> None:
    """Write or check proof files of instances, and print a line for each."""
    from cgla_graph.comparisons.conformance import proof_files
    from cgla_graph.comparisons.conformance.report import picked
    from cgla_graph.errors import CglaError

    folder, is_known, rest = None, True, iter(words[1:])
    # (options behind the command of a planner are the planner's: they end up among the words)
    for word in rest:
        if word == "--json":
            as_json = True
        elif word == "--instances":
            names = next(rest, "")
        else:
            is_known = is_known and folder is None and not word.startswith("-")
            folder = Path(word)
    if not is_known or (words[0] == "prove" and folder is None):
        usage = "cgla conform verify [FOLDER]" if words[0] == "verify" else "cgla conform prove FOLDER"
        msg = f"cgla conform {' '.join(words)}: write {usage}, with --instances A,B for some of them, or --json"
        raise CglaError(msg)
    asked = picked(names)
    is_made = words[0] == "prove"
    lines = proof_files.prove_suite(asked, folder) if folder and is_made else proof_files.verify_suite(asked, folder)
    found = []
    for one in lines:
        missing = not one.found and not one.fault
        text = proof_files.without_file(one.file.name) if missing else one.text()
        found.append({**one.document(), **({"verified": None, "remedy": text} if missing else {})})
        word = ("written" if is_made else "verified") if one.found else "no file" if missing else "refused"
        console.out_lines({} if as_json else {word: text})
    if as_json:
        console.out_json({"proofs": found})
    if any(one.get("fault") for one in found):
        raise typer.Exit(console.MISSING)


def _show_conformance(name: str | None, *, schema: bool, as_json: bool) -> None:
    """Print the problem of an instance, the schemas, or the list of all instances."""
    from cgla_graph.comparisons.conformance import report as suite

    if name is not None:
        console.out(suite.problem_text(name))
    elif schema:
        from cgla_graph.comparisons.conformance.documents import conformance_schema

        console.out_json(conformance_schema())
    elif as_json:
        console.out_json(suite.listing())
    else:
        suite.print_listing()


def answer(
    solver: SolverOption = "hybrid",
    resolution: Annotated[int, option("--resolution N", "points per side of a closed lattice")] = 20,
    refine: RefineOption = False,
) -> None:
    """
    Answer a problem of the conformance suite with one of our solvers: a planner for cgla conform.

    Reads the problem as JSON from standard input, and writes the path as JSON to standard output.
    """
    import json

    from cgla_graph.comparisons.conformance import report as suite

    console.out(json.dumps(suite.answer(suite.read_stdin(), solver, resolution, refine=refine), allow_nan=False) + "\n")
