"""The commands and their modules; each command is imported when it is looked up."""

import copy
import functools
import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, TypeAlias, cast, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from cgla_graph.comparisons import console

_BY_NAME = inspect.Parameter.KEYWORD_ONLY
#: Options of graphs in version 0.1, where `plan` took their files; of `compare`, which passes them on.
_OF_GRAPHS = {"--from", "--to", "--weight", "--directed"}
_OF_PAIRS = {*_OF_GRAPHS, "--pairs", "--source", "--target"}
#: Place of a command: its module and function; of a group of commands, its help and the commands.
Place: TypeAlias = "str | tuple[str, dict[str, Place]]"
COMMANDS: "dict[str, Place]" = {
    "compare": "compare:compare",
    "plan": "plan:plan",
    "graph": (
        "Plan on a graph of your own: the nodes and edges of a file.",
        {"plan": "graph:plan", "compare": "graph:compare", "check": "graph:check"},
    ),
    "pareto": "pareto:pareto",
    "certify": "certify:certify",
    "verify": "certify:verify",
    "check": "check:check",
    "conform": "conform:conform",
    "answer": "conform:answer",
    "fly": "fly:fly",
    "results": "results:results",
    "view": "results:view",
    "live": "results:live",
    "claims": "claims:claims",
    "solvers": "listings:solvers",
    "scenarios": "listings:scenarios",
    "missions": "listings:missions",
}


class Commands(Mapping[str, Any]):
    """Commands by name, each imported when it is looked up."""

    def __init__(self, places: "dict[str, Place]") -> None:
        self.places = places

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self.places)

    def __len__(self) -> int:
        """Count the commands."""
        return len(self.places)

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401 - a command, or a group of them
        """Return a command of click."""
        place = self.places[name]
        if isinstance(place, str):
            return _imported(name, place)
        text, inner = place
        return CommandGroup(inner, name=name, help=text, rich_markup_mode=None)


class CommandGroup(TyperGroup):
    """A group of commands, each imported when it is looked up."""

    def __init__(self, places: "dict[str, Place] | None" = None, **settings: Any) -> None:  # noqa: ANN401 - typer's
        commands = Commands(COMMANDS if places is None else places)
        super().__init__(**{**settings, "commands": cast("Any", commands)})

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401 - click's, which typer holds in itself
        """List the names without importing the commands."""
        del ctx
        return list(self.commands)


class TopicCommand(TyperCommand):
    """A command whose help lists its options by topic: a heading for each group of options."""

    def format_options(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - click's, which typer holds in itself
        """Write the arguments, the options of no group, and each group."""
        topics: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for one in self.get_params(ctx):
            if (record := one.get_help_record(ctx)) is not None:
                usual = "Arguments" if one.param_type_name == "argument" else "Options"
                topics.setdefault(getattr(one, "rich_help_panel", None) or usual, []).append(record)
        for topic, records in topics.items():
            if records:
                with formatter.section(topic):
                    formatter.write_dl(records)


@functools.cache
def _imported(name: str, place: str) -> Any:  # noqa: ANN401 - click's, which typer holds in itself
    """Import the function of a command, and read its options."""
    module, _, function = place.partition(":")
    home = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    # words after the planner's name are options of the planner
    settings = {"allow_interspersed_args": name != "conform"}
    register = home.command(name, cls=TopicCommand, context_settings=settings)
    register(flattened(getattr(importlib.import_module(f"cgla_graph.comparisons.cli.{module}"), function)))
    return typer.main.get_command(home)


def flattened(function: Callable[..., None]) -> Callable[..., None]:
    """
    Replace each parameter that is a group of options by its options, for typer.

    If groups share an option, each gets its value, and the help lists it with the first. The heading of a group in the
    help is the first line of its docstring, up to a colon.

    Examples
    --------
    >>> from cgla_graph.comparisons.cli.options import ExportOptions, ZoneOptions
    >>> def plan(scenario: str, export: ExportOptions, zones: ZoneOptions) -> None:
    ...     print(scenario, export.altitude, zones.altitude, zones.at)
    >>> flattened(plan)(scenario="paper", altitude=80.0, at="now")
    paper 80.0 80.0 now
    >>> list(inspect.signature(flattened(plan)).parameters)[:4]
    ['scenario', 'export', 'altitude', 'above']
    """
    hints = get_type_hints(function, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    flat = {}
    for name, parameter in inspect.signature(function).parameters.items():
        kind = groups.get(name)
        if kind is None:
            flat[name] = parameter.replace(kind=_BY_NAME, annotation=hints[name])
            continue
        for one in fields(kind):
            annotation = _under(kind, one.type)
            flat.setdefault(one.name, inspect.Parameter(one.name, _BY_NAME, default=one.default, annotation=annotation))

    @functools.wraps(function)
    def command(**given: Any) -> None:  # noqa: ANN401 - values of any options
        of_groups = {name: {one.name for one in fields(kind)} & set(given) for name, kind in groups.items()}
        gathered = {name: groups[name](**{one: given[one] for one in found}) for name, found in of_groups.items()}
        function(**{name: value for name, value in given.items() if name in hints and name not in groups}, **gathered)

    command.__signature__ = inspect.Signature(list(flat.values()))  # type: ignore[attr-defined]
    command.__annotations__ = {name: one.annotation for name, one in flat.items()}
    return command


def _under(group: type, annotation: Any) -> Any:  # noqa: ANN401 - a type and its option
    """Return the annotation of an option with the heading of its group."""
    (found,) = annotation.__metadata__
    found = copy.copy(found)
    found.rich_help_panel = (group.__doc__ or "Options").splitlines()[0].partition(":")[0].rstrip(".")
    return Annotated[annotation.__origin__, found]


def renamed(words: list[str]) -> list[str]:
    """Replace the names that commands on graphs had in version 0.1, with a message; `compare` takes graphs as well."""
    old, new = words[:1], ["graph", *words[:1]]
    if old == ["compare"]:
        return [*new, *words[1:]] if {word.partition("=")[0] for word in words} & _OF_PAIRS else words
    if old == ["check-graph"]:
        new = ["graph", "check"]
    elif old != ["plan"] or not {word.partition("=")[0] for word in words} & _OF_GRAPHS:
        return words
    console.say(f"cgla: cgla {old[0]} on a graph is now cgla {' '.join(new)}; version 0.3 removes the old name")
    return [*new, *words[1:]]
