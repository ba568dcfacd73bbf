"""Objects of JSON with the place they were found at: each value is checked, and errors name zone and key."""

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from cgla_graph.airspace.zones.shapes import short
from cgla_graph.untrusted.files import fault


class Entry:
    """
    An object of a document.

    Parameters
    ----------
    value
        What was found there.
    where
        What errors call it.

    Raises
    ------
    FileFormatError
        If it is no object; and by all methods if a value is not what it should be.

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
        """Whether there is a value other than null."""
        return self.values.get(key) is not None

    def wrong(self, key: str, remedy: str) -> NoReturn:
        """Raise the error of a key."""
        said = f"it is {short(self.values[key])}" if key in self.values else "it is missing"
        fault(f"{self.where}: {key}", said, remedy)

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; `default` where there is none, or else that is an error."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, str) or (not value.strip() and default is None):
            self.wrong(key, "give a text")
        return " ".join(value.split())

    def choice(self, key: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Return one of the allowed words, in capitals, however it is written."""
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
        if type(value) not in {int, float} or not abs(value) <= 1e9:  # noqa: PLR2004 - NaN is not, either
            self.wrong(key, "give a number")
        return float(value)

    def entry(self, key: str) -> "Entry":
        """Return an object in it."""
        if key not in self.values:
            self.wrong(key, "give an object, {…}")
        return Entry(self.values[key], f"{self.where}: {key}")

    def entries(self, key: str, *, empty: bool = True) -> list["Entry"]:
        """Return a list of objects; none where there is no list, unless that is an error."""
        return [Entry(value, f"{self.where}: {key}[{index}]") for index, value in enumerate(self.items(key, empty))]

    def items(self, key: str, empty: bool = True) -> list[object]:
        """Return a list; empty where there is none, unless that is an error."""
        value = self.values.get(key)
        if value is None and empty:
            return []
        if not isinstance(value, list) or not (value or empty):
            self.wrong(key, "give a list, […]" if empty else "give a list of at least one")
        return value

    def wording(self, key: str) -> str:
        """Return what is meant for people: a text, or texts in languages of which English comes first; or nothing."""
        value = self.values.get(key)
        texts = value if isinstance(value, list) else [value]
        spoken = [one if isinstance(one, dict) else {"text": one} for one in texts if one is not None]
        if not all(isinstance(one.get("text"), str) for one in spoken):
            self.wrong(key, 'give a text, or a list of {"text": …, "lang": …}')
        spoken.sort(key=lambda one: not str(one.get("lang", "")).lower().startswith("en"))
        return " ".join(str(spoken[0]["text"]).split()) if spoken else ""
