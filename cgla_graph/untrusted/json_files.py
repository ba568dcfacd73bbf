"""Reader of untrusted JSON, bounded in depth and size, without duplicate keys and NaN."""

import json
from typing import NoReturn

import numpy as np

from cgla_graph._text import shown
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import fault, text_of
from cgla_graph.untrusted.numbers import parse_float

#: Greatest depth of nested objects and lists.
DEEPEST = 64
#: Objects, and objects and lists together, at most: 50 MB of positions have fewer, 50 MB of brackets more.
MOST_OBJECTS, MOST_LISTS = 1_000_000, 4_000_000


class _RefusedError(Exception):
    """Error message for valid JSON that is refused."""


def json_of(data: bytes, file: str) -> object:
    """
    Return the value of the bytes of a JSON file, named `file` in errors.

    Raises
    ------
    FileFormatError
        If it is too large or nested too deeply, is not JSON (which has no NaN), or has a key twice in an object.

    Examples
    --------
    >>> json_of(b'{"a": 1, "a": 2}', "zones.json")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.FileFormatError: zones.json: the key 'a' stands twice in one object; leave one of them
    """
    return json_value(text_of(data, file), file)


def json_value(
    text: str, file: str, *, most_objects: int = MOST_OBJECTS, most_lists: int = MOST_LISTS, infinite: bool = False
) -> object:
    """
    Return the value of a JSON text, named `file` in errors; the errors are those of `json_of`.

    Parameters
    ----------
    text, file
        The text and its name.
    most_objects, most_lists
        Limits of its size.
    infinite
        Whether NaN and infinity are allowed, as Python writes them.

    Examples
    --------
    >>> json_value("[1e400]", "zones.json")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.FileFormatError: zones.json: 1e400 is too large for a number; give one of at most 1.8e308
    """
    _require_shape(text, file, most_objects, most_lists)
    constant = float if infinite else _no_constant
    try:
        return json.loads(text, object_pairs_hook=_one_value_a_key, parse_constant=constant, parse_float=_number)
    except json.JSONDecodeError as error:
        fault(file, f"line {error.lineno}, column {error.colno}: not JSON ({error.msg})", "correct it there")
    except _RefusedError as error:
        raise FileFormatError(f"{file}: {error}") from error  # noqa: TRY003, EM102 - the message was made there
    except (ValueError, RecursionError) as error:
        fault(file, f"not JSON that can be read ({str(error)[:100]})", "remove numbers of thousands of digits")


def _require_shape(text: str, file: str, most_objects: int, most_lists: int) -> None:
    """Check depth and size of a document before it is parsed."""
    # (an escaped quote does not end a string)
    plain = text.replace("\\\\", "").replace('\\"', "")
    codes = np.frombuffer(plain.encode("utf-8"), dtype=np.uint8)
    step = np.zeros(256, dtype=np.int8)
    step[[ord("["), ord("{")]], step[[ord("]"), ord("}")]] = 1, -1
    quote = ord('"')
    marks = codes[(step[codes] != 0) | (codes == quote)]
    inside = np.cumsum(marks == quote, dtype=np.int32) % 2 == 1
    marks = marks[~inside & (marks != quote)]
    steps = step[marks]
    if np.cumsum(steps, dtype=np.int32).max(initial=0) > DEEPEST:
        fault(file, f"it is nested more than {DEEPEST} deep", "leave out the nested parts")
    objects, both = int((marks == ord("{")).sum()), int((steps == 1).sum())
    if objects > most_objects or both > most_lists:
        wrong = f"it has {objects:,} objects and {both - objects:,} lists, more than {most_objects:,} or {most_lists:,}"
        fault(file, wrong, "cut out the part that matters")


def _one_value_a_key(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return an object; refuse a duplicate key, because one of its values would be lost."""
    made = dict(pairs)
    if len(made) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        msg = f"the key {shown(twice)} stands twice in one object; leave one of them"
        raise _RefusedError(msg)
    return made


def _number(text: str) -> float:
    """Return a float; refuse one that is too large."""
    try:
        return parse_float(text)
    except ValueError as error:
        raise _RefusedError(str(error)) from error


def _no_constant(name: str) -> NoReturn:
    """Refuse NaN and Infinity."""
    msg = f"it has {name}, which is not JSON; write a number, or null"
    raise _RefusedError(msg)
