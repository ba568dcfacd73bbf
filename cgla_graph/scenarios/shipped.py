"""The files that the toolkit ships: scenarios and missions, by name."""

import difflib
from dataclasses import dataclass
from importlib import resources
from typing import Any


@dataclass(frozen=True)
class ShippedFiles:
    """
    The TOML files of one kind that are shipped.

    Attributes
    ----------
    kind
        What one of them is called.
    folder
        Where they are.
    endings
        How files of the user's own end, in words.
    error
        Raised for a name that is not there.

    Examples
    --------
    >>> "paper" in ShippedFiles("scenario", "maps", ".toml", ValueError).names()
    True
    """

    kind: str
    folder: str
    endings: str
    error: type[Exception]

    def names(self) -> list[str]:
        """List the names in the order of the alphabet."""
        return sorted(
            file.name.removesuffix(".toml") for file in self._folder().iterdir() if file.name.endswith(".toml")
        )

    def text(self, name: str, order: list[str], hint: str = "") -> str:
        """Return the file of that name; if there is none, say which are near, or all in that order, or a `hint`."""
        if name not in order:
            near = difflib.get_close_matches(name, order, n=3, cutoff=0.4)
            remedy = hint or (f"did you mean {' or '.join(near)}?" if near else f"shipped: {', '.join(order)}.")
            msg = f"unknown {self.kind} {name!r}; {remedy} A file ends in {self.endings}"
            raise self.error(msg)
        return str((self._folder() / f"{name}.toml").read_text(encoding="utf-8"))

    def _folder(self) -> Any:  # noqa: ANN401 - importlib's Traversable moved between versions
        return resources.files("cgla_graph.scenarios") / self.folder
