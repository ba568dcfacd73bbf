"""JSON objects with their place in the document: values are checked on access, and errors name zone and key."""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

from cgla_graph._text import shown
from cgla_graph.airspace.zones.shapes import short
from cgla_graph.untrusted.files import fault

#: Likeness from which on an unknown key is a misspelt one, 1 for the same letters.
NEAR = 0.85


class Entry:
    """
    A JSON object of a document.

    Parameters
    ----------
    value
        The parsed JSON, which must be an object.
    where
        Name of the place in errors.

    Raises
    ------
    FileFormatError
        If `value` is not an object. All methods raise it if a value is not valid.

    Examples
    --------
    >>> Entry({"unit": "M"}, "zones.json: zone 'A'").choice("unit", ["M", "FT"])
    'M'
    """

    def __init__(self, value: object, where: str) -> None:
        if not isinstance(value, dict):
            fault(where, f"it is {short(value)}", "give an object, {…}")
        self.values: Mapping[str, Any] = value
        self.where = where

    def has(self, key: str) -> bool:
        """Return whether a key has a value other than null."""
        return self.values.get(key) is not None

    def wrong(self, key: str, remedy: str) -> NoReturn:
        """Raise the error of an invalid value of a key."""
        said = f"it is {short(self.values[key])}" if key in self.values else "it is missing"
        fault(f"{self.where}: {key}", said, remedy)

    def require_spelling(self, known: Sequence[str], likeness: float = NEAR) -> None:
        """Refuse a key that is nearly one of the known ones: what it says would not count."""
        others = [key for key in self.values if key not in known]
        plain = {re.sub(r"[^a-z0-9]", "", key.lower()): key for key in known}
        for key in others:
            near = get_close_matches(re.sub(r"[^a-z0-9]", "", key.lower()[:60]), plain, n=1, cutoff=likeness)
            if near:
                fault(f"{self.where}: {shown(key)}", "there is no such key", f"write {plain[near[0]]}, or leave it out")

    def text(self, key: str) -> str:
        """Return a text that is not blank."""
        value = self.values.get(key)
        if not isinstance(value, str) or not value.strip():
            self.wrong(key, "give a text")
        return " ".join(value.split())

    def choice(self, key: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Return one of the allowed words in capitals; the file may use any case."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        word = value.strip().upper() if isinstance(value, str) else ""
        if word not in allowed:
            self.wrong(key, f"give one of {', '.join(allowed)}")
        return word

    def number(self, key: str) -> float:
        """Return a finite number."""
        value: Any = self.values.get(key)
        if type(value) not in {int, float} or not abs(value) <= 1e9:  # noqa: PLR2004 - also false for NaN
            self.wrong(key, "give a number")
        return float(value)

    def entry(self, key: str) -> "Entry":
        """Return the object at a key."""
        if key not in self.values:
            self.wrong(key, "give an object, {…}")
        return Entry(self.values[key], f"{self.where}: {key}")

    def entries(self, key: str, *, empty: bool = True) -> list["Entry"]:
        """Return the objects of a list; a missing list is empty, or an error if `empty` is false."""
        return [Entry(value, f"{self.where}: {key}[{index}]") for index, value in enumerate(self.items(key, empty))]

    def items(self, key: str, empty: bool = True) -> list[object]:
        """Return a list; a missing list is empty, or an error if `empty` is false."""
        value = self.values.get(key)
        if value is None and empty:
            return []
        if not isinstance(value, list) or not (value or empty):
            self.wrong(key, "give a list, […]" if empty else "give a list of at least one")
        return value

    def wording(self, key: str) -> str:
        """Return a text for readers; of texts in several languages, the English one; empty if there is none."""
        value = self.values.get(key)
        texts = value if isinstance(value, list) else [value]
        spoken = [one if isinstance(one, dict) else {"text": one} for one in texts if one is not None]
        if not all(isinstance(one.get("text"), str) for one in spoken):
            self.wrong(key, 'give a text, or a list of {"text": …, "lang": …}')
        spoken.sort(key=lambda one: not str(one.get("lang", "")).lower().startswith("en"))
        return " ".join(str(spoken[0]["text"]).split()) if spoken else ""
