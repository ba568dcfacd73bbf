"""The commands `solvers`, `scenarios` and `missions`, which list names."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import JsonOption, option


def solvers(as_json: JsonOption = False) -> None:
    """
    List the solvers.

    Prints a summary, the guarantees and the settings of each, and the package that it lacks.
    """
    from cgla_graph.solvers import listing

    lines = [listing.describe(name) for name in listing.built_in()]
    for name in listing.plug_ins():
        from cgla_graph.solvers import registry

        lines.append(registry.describe(name))
    print_listing("solvers", list(lines[0]), lines, as_json)


def scenarios(
    show: Annotated[str | None, option("--show NAME", "print the file of a shipped scenario")] = None,
    schema: Annotated[bool, option("--schema", "print the JSON schema of scenario files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    List the shipped scenarios.

    With --show, prints the file of a scenario as an example; with --schema, the JSON schema of such files.
    """
    from cgla_graph.scenarios import shipped

    if schema:
        from cgla_graph.scenarios.scenario import schema as schema_of

        console.out_json(schema_of())
    elif show is not None:
        console.out(shipped.shipped_scenario(show))
    else:
        print_listing("scenarios", ["name", "title"], shipped.scenario_list(), as_json)


def missions(
    show: Annotated[str | None, option("--show NAME", "print the file of a shipped mission")] = None,
    schema: Annotated[bool, option("--schema", "print the JSON schema of mission files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    List the shipped missions.

    With --show, prints the file of a mission as an example; with --schema, the JSON schema of such files.
    """
    from cgla_graph.scenarios import shipped

    if schema:
        from cgla_graph.scenarios.mission_file import mission_schema

        console.out_json(mission_schema())
    elif show is not None:
        console.out(shipped.shipped_mission(show))
    else:
        lines = shipped.mission_list()
        print_listing("missions", ["name", "title", "uavs", "variants"], lines, as_json, {"title": 30, "variants": 20})


def print_listing(
    what: str,
    heads: Sequence[str],
    lines: Sequence[Mapping[str, Any]],
    as_json: bool,
    widest: Mapping[str, int] | None = None,
) -> None:
    """Print records as JSON with all keys, or as a table of the columns `heads` with some widths limited."""
    if as_json:
        console.out_json({what: lines})
        return
    plain = [
        {head: ", ".join(line[head]) if isinstance(line[head], list) else line[head] for head in heads}
        for line in lines
    ]
    console.out_table(console.listing(what, heads, plain, widest))
