"""Writer of the file that `cgla_graph.solvers.listing` reads."""

import json
from importlib import resources
from pathlib import Path

from cgla_graph.solvers import listing, registry


def listing_text() -> str:
    """
    Return the text of the file, made from the solvers themselves.

    Examples
    --------
    >>> '"cgla"' in listing_text()
    True
    """
    found: dict[str, dict[str, object]] = {}
    for name in filter(registry.is_built_in, registry.names(installed=False)):
        said = registry.describe(name)
        found[name] = {key: said[key] for key in ("domain", "promises", "settings", "summary")}
        found[name]["needs"] = list(registry.traits(name).needs)
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    Path(str(resources.files("cgla_graph.solvers") / listing.FILE)).write_text(listing_text(), encoding="utf-8")
