"""The lowest versions that `pyproject.toml` allows, one pin a line, for `make oldest`."""

import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement

PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"


def pins(extras: Iterable[str] = ()) -> list[str]:
    """
    Return a pin to the lower bound of each requirement that this Python needs.

    Raises
    ------
    ValueError
        If a requirement has no lower bound.
    """
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    texts = [*project["dependencies"], *(text for extra in extras for text in project["optional-dependencies"][extra])]
    found = []
    for requirement in map(Requirement, texts):
        if requirement.marker is not None and not requirement.marker.evaluate(default_environment()):
            continue
        lowest = [one.version for one in requirement.specifier if one.operator == ">="]
        if len(lowest) != 1:
            msg = f"{requirement} has no lower bound in pyproject.toml; name the oldest version that works, as >=1.0"
            raise ValueError(msg)
        found.append(f"{requirement.name}=={lowest[0]}")
    return found


if __name__ == "__main__":
    print("\n".join(pins(name for names in sys.argv[1:] for name in names.split(","))))
