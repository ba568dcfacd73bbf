"""What a REPL shows of a thing: its name and its fields, in at most `MOST` characters, however large they are."""

import dataclasses
import reprlib
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from enum import Enum

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

#: Characters of a whole `repr`, at most, and of the value of one field.
MOST, MOST_OF_FIELD, MOST_OF_TEXT = 300, 80, 60
#: What is worked out and belongs to what a thing says of itself.
_WORKED_OUT = ("cost", "length", "risk", "gap")


class Brief:
    """Gives dataclasses a short `repr`; nothing compares, hashes or writes them by it."""

    def __init_subclass__(cls) -> None:
        """Put it in the class itself: there, `dataclass` leaves it as it is."""
        super().__init_subclass__()
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = brief  # type: ignore[method-assign]


def brief(thing: object) -> str:
    """
    Write the name of a dataclass and its fields that are not as they are by default, within `MOST` characters.

    Examples
    --------
    >>> from cgla_graph.model.solution import Solution, Status
    >>> brief(Solution(Status.FOUND, path=np.zeros((900, 2)), cost=1.25, lower_bound=1.0))
    'Solution(status=found, path=900 x 2 array, cost=1.25, lower_bound=1, gap=0.25)'
    """
    text = ""
    for name, value in fields_of(thing):
        part = f"{', ' if text else ''}{name}={value}"
        if len(type(thing).__name__) + len(text) + len(part) + len("(, …)") > MOST:
            text += ", …"
            break
        text += part
    return f"{type(thing).__name__}({text})"


def fields_of(thing: object) -> Iterator[tuple[str, str]]:
    """
    Name the fields that are shown, with their values in short.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> dict(fields_of(Problem((0, 0), (1, 1), k=10.0)))
    {'start': '(0.0, 0.0)', 'goal': '(1.0, 1.0)', 'k': '10'}
    """
    for field in dataclasses.fields(thing):  # type: ignore[arg-type]
        value = getattr(thing, field.name, None)
        if field.repr and not _is_default(field, value):
            yield field.name, short(value)
    own = {field.name for field in dataclasses.fields(thing)}  # type: ignore[arg-type]
    for name in (name for name in _WORKED_OUT if name not in own):
        value = getattr(thing, name, None)
        if isinstance(value, float) and not np.isnan(value):
            yield name, short(value)


def short(value: object) -> str:
    """
    Write a value on one line, within `MOST_OF_FIELD` characters.

    Examples
    --------
    >>> short(np.zeros((3, 2))), short(range(1000)), short(shapely.box(0, 0, 1, 1)), short(2 / 3)
    ('3 x 2 array', '1000 ints', 'Polygon of 5 points', '0.666667')
    """
    match value:
        case bool() | int() | None:
            text = repr(value)
        case float() | np.floating():
            text = f"{value:.6g}"
        case Enum():
            text = str(getattr(value, "label", value.name))
        case np.ndarray():
            text = f"{' x '.join(map(str, value.shape)) or 'single'} array"
        case BaseGeometry():
            text = f"{value.geom_type} of {shapely.get_num_coordinates(value)} points"
        case str():
            text = repr(value if len(value) < MOST_OF_TEXT else f"{value[: MOST_OF_TEXT - 1]}…")
        case Mapping():
            text = reprlib.repr(dict(value)) if len(value) <= _FEW and _are_small(value.values()) else _count(value)
        case Sequence() | AbstractSet():
            text = _series(value)
        case _:
            text = repr(value)
    text = " ".join(text.split())
    if len(text) <= MOST_OF_FIELD:
        return text
    return f"{type(value).__name__}(…)"


#: So many members of a series or a mapping are written one by one.
_FEW = 4


def _series(values: "Sequence[object] | AbstractSet[object]") -> str:
    if len(values) <= _FEW and _are_small(values):
        return repr(tuple(values)) if isinstance(values, tuple) else repr(values)
    return _count(values)


def _are_small(values: object) -> bool:
    return all(value is None or isinstance(value, int | float | str) for value in values)  # type: ignore[attr-defined]


def _count(values: "Sequence[object] | AbstractSet[object] | Mapping[object, object]") -> str:
    """Say how many there are, and of what."""
    first = next(iter(values.values() if isinstance(values, Mapping) else values), None)
    kind = "item" if first is None else type(first).__name__
    return f"{len(values)} {kind}{'' if len(values) == 1 else 's'}"


def _is_default(field: "dataclasses.Field[object]", value: object) -> bool:
    """Tell whether a field is as it is by default, where that can be told at a glance."""
    if isinstance(value, np.ndarray | BaseGeometry):
        return isinstance(value, np.ndarray) and value.size == 0
    default = field.default
    if isinstance(default, float) and isinstance(value, float) and np.isnan(default):
        return bool(np.isnan(value))
    if default is not dataclasses.MISSING:
        return type(default) is type(value) and bool(default == value)
    if field.default_factory is not dataclasses.MISSING and (value is None or isinstance(value, Sequence | Mapping)):
        return not value
    # a field without threats says nothing
    return field.default_factory is not dataclasses.MISSING and hasattr(value, "threats") and not value
