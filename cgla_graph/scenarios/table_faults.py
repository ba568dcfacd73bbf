"""Error messages for faults in TOML tables: all faults of a file in one line, mistyped keys first."""

import difflib
import typing
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from cgla_graph._text import shown

#: How pydantic names members of unions, which are no keys; tags of our own begin with "=".
UNION_MEMBERS = ("int", "float", "str", "bool", "list[", "=")
#: The most faults in one message.
MOST = 5
#: The remedy for each of pydantic's kinds of faults.
ALLOWED: Mapping[str, str] = {
    "finite_number": "give a finite number",
    "float_type": "give a number",
    "int_type": "give a whole number",
    "int_from_float": "give a whole number",
    "string_type": "give a text in quotes",
    "bool_type": "give true or false",
    "list_type": "give a list",
    "dict_type": "give a table",
    "model_type": "give a table of keys and values",
    "json_invalid": "give JSON ({error})",
    "too_short": "give at least {min_length}, not {actual_length}",
    "too_long": "give at most {max_length}, not {actual_length}",
    "string_too_short": "give a text of at least {min_length} characters",
    "greater_than": "give a number greater than {gt:g}",
    "greater_than_equal": "give at least {ge:g}",
    "less_than": "give a number less than {lt:g}",
    "less_than_equal": "give at most {le:g}",
    "literal_error": "choose {expected}",
}


def faults(error: ValidationError, kind: type[BaseModel], command: str = "") -> str:
    """
    Describe all faults in one line: for each the key's path, the allowed values and the value.

    Mistyped keys come first; keys that are missing for that reason alone are left out.

    Parameters
    ----------
    error
        The faults that pydantic found.
    kind
        The table of the whole file.
    command
        The command that prints the schema of such files; empty if there is none.

    Examples
    --------
    >>> class Own(BaseModel, extra="forbid", strict=True):
    ...     k: float
    ...     start: list[float]
    >>> try:
    ...     _ = Own.model_validate({"kk": 10, "start": [1.0, "2"]})
    ... except ValidationError as error:
    ...     print(faults(error, Own, "cgla scenarios --schema"))
    kk: unknown key; did you mean k? start.1: give a number (it is '2'); cgla scenarios --schema lists allowed values
    """
    every = error.errors()
    typos: list[str] = []
    #: keys that are like no other, by those that there are
    strange: dict[str, list[str]] = {}
    meant: set[tuple[int | str, ...]] = set()
    for fault in every:
        if fault["type"] == "extra_forbidden":
            *above, key = fault["loc"]
            keys = list(_table_at(kind, above).model_fields)
            near = difflib.get_close_matches(str(key), keys, n=1)
            meant |= {(*above, name) for name in near}
            if near:
                typos.append(f"{_place(fault['loc'])}: unknown key; did you mean {near[0]}?")
            else:
                strange.setdefault(", ".join(keys), []).append(_place(fault["loc"]))
    for keys_there, places in strange.items():
        many = "s" * (len(places) > 1)
        typos.append(f"{', '.join(places[:MOST])}: unknown key{many}; known keys: {keys_there}.")
    # of a union, each member has a fault of its own
    joined: dict[str, list[Any]] = {}
    for fault in every:
        if fault["type"] not in {"extra_forbidden", "missing"}:
            joined.setdefault(_place(fault["loc"]), []).append(fault)
    # (a member that fits so far, and has a fault further down, is the one that was meant)
    wrong = [
        _wrong(place, found)
        for place, found in joined.items()
        if not any(deeper.startswith(f"{place}.") for deeper in joined if place)
    ]
    places = [_place(fault["loc"]) for fault in every if fault["type"] == "missing" and fault["loc"] not in meant]
    needed = "these keys are needed; add them" if len(places) > 1 else "this key is needed; add it"
    described = [*wrong, *([f"{', '.join(places)}: {needed}"] if places else [])]
    left = len(typos) + len(described) - MOST
    # the message for a typo ends with a question mark or a full stop
    text = " ".join(filter(None, [" ".join(typos[:MOST]), "; ".join(described[: max(MOST - len(typos), 0)])]))
    more = f"; and {left} more fault{'s' * (left > 1)}" if left > 0 else ""
    return f"{text}{more}; {command} lists allowed values" if command and (described or more) else f"{text}{more}"


def _wrong(place: str, found: Sequence[Any]) -> str:
    """Describe the fault of a value."""
    said: list[str] = []
    for fault in found:
        allowed = ALLOWED.get(fault["type"])
        text = allowed.format(**fault.get("ctx", {})) if allowed else fault["msg"].removeprefix("Value error, ")
        said.append(text.removeprefix("give ") if said else text)
    what = f"{' or '.join(dict.fromkeys(said))} (it is {shown(found[0]['input'])})"
    return f"{place}: {what}" if place else what


def _place(loc: Sequence[int | str]) -> str:
    """Write a path as the file does: pydantic names the member of a union as well."""
    return ".".join(str(part) for part in loc if not str(part).startswith(UNION_MEMBERS))


def _table_at(kind: type[BaseModel], loc: Sequence[int | str]) -> type[BaseModel]:
    """Find the kind of table at a place in the file: keys lead into tables, all other parts stay in the same."""
    for part in loc:
        if part in kind.model_fields:
            kind = next(_tables_in(kind.model_fields[str(part)].annotation), kind)
    return kind


def _tables_in(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - any type form
    """List the tables that a type is made of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from _tables_in(part)
