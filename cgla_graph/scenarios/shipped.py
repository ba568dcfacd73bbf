"""Shipped scenarios and missions, by name; they are listed without being built."""

import difflib
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from cgla_graph._text import place, shown
from cgla_graph.errors import MissionError, ScenarioError
from cgla_graph.scenarios.text_files import is_file


@dataclass(frozen=True)
class ShippedFiles:
    """
    The shipped TOML files of one kind.

    Attributes
    ----------
    kind
        The word for one of them.
    folder
        Their folder.
    endings
        The endings of the user's own files, in words.
    error
        Raised for an unknown name.
    rank
        The sort key of names.

    Examples
    --------
    >>> SCENARIOS.names()[0], MISSIONS.names()[0]
    ('paper', 'fig4')
    """

    kind: str
    folder: str
    endings: str
    error: type[Exception]
    rank: Callable[[str], Any]

    def names(self) -> list[str]:
        """List the names, those of the paper first."""
        names = (file.name.removesuffix(".toml") for file in self._folder().iterdir() if file.name.endswith(".toml"))
        return sorted(names, key=self.rank)

    def text(self, name: str, hint: str = "") -> str:
        """Return the file of a name; for an unknown name, the error gives the `hint`, near names, or all names."""
        order = self.names()
        if name not in order and re.search(r"\.[A-Za-z]\w{0,9}$", name):
            there = f"a {self.kind} is no such file" if is_file(Path(name)) else "there is no such file"
            msg = f"{place(name)}: {there}: check the name and the folder; a {self.kind} ends in {self.endings}"
            raise self.error(msg)
        if name not in order:
            near = difflib.get_close_matches(name, order, n=3, cutoff=0.4)
            remedy = hint or (f"did you mean {' or '.join(near)}?" if near else f"shipped: {', '.join(order)}.")
            msg = f"unknown {self.kind} {shown(name)}; {remedy} A file ends in {self.endings}"
            raise self.error(msg)
        return str((self._folder() / f"{name}.toml").read_text(encoding="utf-8"))

    def documents(self) -> dict[str, dict[str, Any]]:
        """Return the content of each file, by name."""
        import tomllib  # noqa: PLC0415 - completing a name reads no file

        return {name: tomllib.loads(self.text(name)) for name in self.names()}

    def _folder(self) -> Any:  # noqa: ANN401 - importlib's Traversable moved between versions
        return resources.files("cgla_graph.scenarios") / self.folder


def _figure(name: str) -> tuple[int, float, str]:
    """Sort figures first, by their number and part, then all other names."""
    if not name.startswith("fig"):
        return 1, 0, name
    figure, _, part = name.removeprefix("fig").partition("-")
    words = ("five", "seven")
    return 0, int(figure) + (words.index(part) / len(words) if part in words else 0.0), name


SCENARIOS = ShippedFiles(
    "scenario", "maps", ".toml, .geojson, .map or .scen", ScenarioError, lambda name: (name != "paper", name)
)
MISSIONS = ShippedFiles("mission", "missions", ".toml", MissionError, _figure)


def scenario_list() -> list[dict[str, str]]:
    """
    List the scenarios: name, title and notes of each.

    Examples
    --------
    >>> scenario_list()[0]["title"]
    "the paper's map, reconstructed: ten threats"
    """
    return [
        {"name": name, "title": file.get("title", ""), "notes": file.get("notes", "")}
        for name, file in SCENARIOS.documents().items()
    ]


def mission_list() -> list[dict[str, Any]]:
    """
    List the missions: name, title, number of UAVs, names of variants, and notes of each.

    Examples
    --------
    >>> mission_list()[-1]["name"], mission_list()[-1]["uavs"]
    ('swarm', 20)
    """
    return [
        {
            "name": name,
            "title": file.get("title", ""),
            "uavs": len(file.get("uavs", ())) + file.get("random_uavs", {}).get("count", 0),
            "variants": [variant["name"] for variant in file.get("variants", ())],
            "notes": file.get("notes", ""),
        }
        for name, file in MISSIONS.documents().items()
    ]


def is_mission_text(text: str) -> bool:
    """
    Return whether a TOML text is a mission's: it lists or draws UAVs, and has no speed as maps that change in time.

    Examples
    --------
    >>> is_mission_text("uavs = []"), is_mission_text("k = 3")
    (True, False)
    """
    keys = _keys_of(text)
    return "speed" not in keys and not keys.isdisjoint({"uavs", "random_uavs"})


def is_timed_text(text: str) -> bool:
    """
    Return whether a TOML text is that of a map that changes in time, with a speed.

    Examples
    --------
    >>> is_timed_text("speed = 1"), is_timed_text("k = 3")
    (True, False)
    """
    return "speed" in _keys_of(text)


def _keys_of(text: str) -> set[str]:
    import tomllib  # noqa: PLC0415 - the same

    try:
        return {*tomllib.loads(text)}
    except (ValueError, RecursionError):
        return set()


def shipped_scenario(name: str) -> str:
    """
    Return the file of a shipped scenario.

    Raises
    ------
    ScenarioError
        If the name is unknown; the message offers the nearest, or says that it is a mission.

    Examples
    --------
    >>> "k = 10.0" in shipped_scenario("paper")
    True
    """
    if name in MISSIONS.names():
        msg = f"{name} is a mission, not a scenario; cgla fly {name} flies it"
        raise ScenarioError(msg)
    return SCENARIOS.text(name)


def shipped_mission(name: str) -> str:
    """
    Return the file of a shipped mission.

    Raises
    ------
    MissionError
        If the name is unknown; the message offers the nearest, or says that it is a scenario.

    Examples
    --------
    >>> "stepnum = 5" in shipped_mission("fig7")
    True
    """
    known = ", ".join(MISSIONS.names())
    is_scenario = name in SCENARIOS.names()
    hint = f"it is a scenario, for cgla plan and compare; missions: {known}." if is_scenario else ""
    return MISSIONS.text(name, hint)
