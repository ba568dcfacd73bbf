"""
Values as JSON, exactly: settings of solvers hold more than JSON has words for.

What it has no word for (tuples, infinity, a lattice) becomes an object with one key that begins with ``!``, as
``{"!float": "inf"}``. So every JSON reader takes it, and nothing that is read can run.
"""

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from cgla_graph.errors import StudyError
from cgla_graph.model.lattice import Lattice

#: What a key begins with that says of which kind a value is.
MARK = "!"


def dumps(document: object) -> str:
    r"""
    Write a document in one line of ASCII, with sorted keys: equal documents are equal texts.

    Examples
    --------
    >>> print(dumps({"b": "é", "a": 1}))
    {"a":1,"b":"\u00e9"}
    """
    return json.dumps(document, sort_keys=True, allow_nan=False, separators=(",", ":"))


def encode(value: object) -> Any:  # noqa: ANN401 - any JSON value
    """
    Turn a value into one that JSON knows.

    Parameters
    ----------
    value
        None, a truth value, a number, text, bytes, a `Lattice`, or a list, tuple, set or mapping of such. NumPy's
        scalars become Python's.

    Returns
    -------
    encoded
        Without NaN and infinities, which JSON does not know.

    Raises
    ------
    StudyError
        If the value, or one in it, is of another kind.

    Examples
    --------
    >>> encode({"a": (1, float("nan"))})
    {'a': {'!tuple': [1, {'!float': 'nan'}]}}
    """
    for kinds, write in _WRITERS:
        if isinstance(value, kinds):
            return write(value)
    msg = f"{value!r} is of type {type(value).__name__}, which no study holds; give numbers, text or lists of these"
    raise StudyError(msg)


def decode(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    """
    Turn what `encode` made back into the value.

    Raises
    ------
    LookupError, TypeError, ValueError
        If it was not made by `encode`.

    Examples
    --------
    >>> decode(encode({"a": (1, float("inf"))}))
    {'a': (1, inf)}
    """
    if isinstance(value, list):
        return [decode(item) for item in value]
    if not isinstance(value, dict):
        return value
    key = next(iter(value)) if len(value) == 1 else ""
    if key.startswith(MARK):
        return _READERS[key.removeprefix(MARK)](value[key])
    return {name: decode(item) for name, item in value.items()}


def lattice_document(lattice: Lattice) -> dict[str, Any]:
    """
    Turn a lattice into a document.

    Examples
    --------
    >>> lattice_document(Lattice(3, bounds=(0, 0, 1, 1)))["resolution"]
    [3, 3]
    """
    return {"resolution": list(lattice.shape), "bounds": list(lattice.bounds), "kind": lattice.kind}


def lattice_from(document: Mapping[str, Any]) -> Lattice:
    """
    Build the lattice of a document.

    Raises
    ------
    LookupError, TypeError, ValueError
        If the document is malformed.

    Examples
    --------
    >>> lattice = Lattice(3, bounds=(0, 0, 1, 1))
    >>> lattice_from(lattice_document(lattice)) == lattice
    True
    """
    columns, rows = document["resolution"]
    return Lattice((columns, rows), bounds=document["bounds"], kind=document["kind"])


def _float(value: float) -> float | dict[str, str]:
    number = float(value)
    return number if math.isfinite(number) else {f"{MARK}float": repr(number)}


def _list(value: list[Any]) -> list[Any]:
    return [encode(item) for item in value]


def _set(value: frozenset[Any] | set[Any]) -> dict[str, Any]:
    kind = "set" if isinstance(value, set) else "frozenset"
    # sets are in no order
    return {f"{MARK}{kind}": sorted((encode(item) for item in value), key=dumps)}


def _mapping(value: Mapping[Any, Any]) -> dict[str, Any]:
    """Write a mapping as an object where its keys allow that, else as pairs."""
    if all(isinstance(key, str) and not key.startswith(MARK) for key in value):
        return {str(key): encode(item) for key, item in value.items()}
    return {f"{MARK}dict": [[encode(key), encode(item)] for key, item in value.items()]}


# the first kind that fits counts: truth values are whole numbers, too
_WRITERS: tuple[tuple[type | tuple[type, ...], Callable[[Any], Any]], ...] = (
    (type(None), lambda value: value),
    (str, str),
    ((bool, np.bool_), bool),
    ((int, np.integer), int),
    ((float, np.floating), _float),
    (list, _list),
    (Mapping, _mapping),
    (tuple, lambda value: {f"{MARK}tuple": _list(list(value))}),
    ((set, frozenset), _set),
    (Lattice, lambda value: {f"{MARK}lattice": lattice_document(value)}),
    (bytes, lambda value: {f"{MARK}bytes": value.hex()}),
    (complex, lambda value: {f"{MARK}complex": [_float(value.real), _float(value.imag)]}),
)

_READERS: Mapping[str, Callable[[Any], Any]] = {
    "float": float,
    "tuple": lambda items: tuple(decode(items)),
    "set": lambda items: set(decode(items)),
    "frozenset": lambda items: frozenset(decode(items)),
    "dict": lambda pairs: {decode(key): decode(item) for key, item in pairs},
    "lattice": lattice_from,
    "bytes": bytes.fromhex,
    "complex": lambda parts: complex(*decode(parts)),
}
