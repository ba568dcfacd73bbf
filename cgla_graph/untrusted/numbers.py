"""Reader of numbers in untrusted text: decimal notation alone, within the range of floats."""

import math
import re
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from cgla_graph._text import cut, shown
from cgla_graph._types import FloatArray

_DECIMAL = re.compile(r"[+-]?(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?+")
_CHARACTERS = frozenset("0123456789.eE+-")
_INFINITE = re.compile(r"([+-]?)inf(?:inity)?", re.IGNORECASE)


def decimal(text: str, *, or_infinite: bool = False) -> float:
    """
    Return a number that is written in decimal notation, as in ``-2``, ``.5`` and ``1e3``.

    Parameters
    ----------
    text
        The number. `float` alone also reads ``1_000`` and digits of other scripts, and makes ``1e400`` infinite.
    or_infinite
        Whether ``inf`` and ``infinity`` are allowed, in any case and with a sign.

    Raises
    ------
    ValueError
        If it is no such number, or is too large for a float; the message continues a sentence that ends in the text.

    Examples
    --------
    >>> decimal("-1.5e3"), decimal("Infinity", or_infinite=True)
    (-1500.0, inf)
    >>> decimal("1,5")
    Traceback (most recent call last):
        ...
    ValueError: has a comma; write decimals with a point, and no separators of thousands
    """
    if _DECIMAL.fullmatch(text):
        return in_range(text)
    if or_infinite and (found := _INFINITE.fullmatch(text)):
        return -math.inf if found[1] == "-" else math.inf
    comma = any(character.isdigit() for character in text) and "," in text
    msg = "has a comma; write decimals with a point, and no separators of thousands"
    raise ValueError(msg if comma else "is no number; give a decimal one, such as 2.5")


def in_range(text: str) -> float:
    """
    Return the float that a text stands for whose notation is known to be right.

    Raises
    ------
    ValueError
        If it is too large for a float; the message continues a sentence that ends in the text.

    Examples
    --------
    >>> in_range("1e300"), in_range("inf")
    (1e+300, inf)
    >>> in_range("-1e400")
    Traceback (most recent call last):
        ...
    ValueError: is too large for a number; give one of at most 1.8e308
    """
    value = float(text)
    if math.isinf(value) and any(character.isdigit() for character in text):
        msg = "is too large for a number; give one of at most 1.8e308"
        raise ValueError(msg)
    return value


def parse_float(text: str) -> float:
    """
    Return a float for `json` and `tomllib`, which call this by the same name.

    Raises
    ------
    ValueError
        If it is too large for a float.

    Examples
    --------
    >>> import tomllib
    >>> tomllib.loads("k = 1e400", parse_float=parse_float)
    Traceback (most recent call last):
        ...
    ValueError: 1e400 is too large for a number; give one of at most 1.8e308
    """
    try:
        return in_range(text)
    except ValueError as error:
        msg = f"{cut(text)} {error}"
        raise ValueError(msg) from error


def plain_numbers(words: Sequence[str]) -> FloatArray:
    """
    Return many numbers in decimal notation; ``nan`` and ``inf`` are numbers here.

    Raises
    ------
    ValueError
        If one is no such number, or is too large for a float; the message names the first.

    Examples
    --------
    >>> plain_numbers(["1", "2.5e1", "nan"]).tolist()
    [1.0, 25.0, nan]
    >>> plain_numbers(["1", "1_000"])
    Traceback (most recent call last):
        ...
    ValueError: number 1 is '1_000', which is no number; give a decimal one, such as 2.5
    """
    # (NumPy reads more than decimal numbers, and makes those infinite that are too large)
    if _CHARACTERS.issuperset("".join(words)):
        with suppress(ValueError):
            values = np.array(words, dtype=np.float64)
            if not np.isinf(values).any():
                return values
    found = []
    for index, word in enumerate(words):
        try:
            is_nan = word.lower().lstrip("+-") == "nan"
            found.append(math.nan if is_nan else decimal(word, or_infinite=True))
        except ValueError as error:
            msg = f"number {index} is {shown(word)}, which {error}"
            raise ValueError(msg) from error
    return np.array(found)


def is_infinite(text: str) -> bool:
    """
    Return whether a text is a word for infinity, with a sign or without one.

    Examples
    --------
    >>> is_infinite("-Inf"), is_infinite("information")
    (True, False)
    """
    return _INFINITE.fullmatch(text) is not None
