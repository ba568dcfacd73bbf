"""Which files hold graphs: told from their endings, before anything that reads graphs is imported."""

import json
from collections.abc import Mapping
from pathlib import Path

from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.text_files import read_text

#: Endings of graph files, and their formats. A ``.json`` may hold no-fly areas as well.
ENDINGS: Mapping[str, str] = {
    ".graphml": "a GraphML file",
    ".json": "a node-link JSON file",
    ".csv": "an edge list",
    ".mtx": "a Matrix Market file",
    ".npz": "a sparse matrix of scipy.sparse.save_npz",
}
#: Texts become many small objects: this many bytes take a few GB.
MOST_TEXT = 200_000_000


def is_graph_file(spec: str) -> bool:
    """
    Say whether an argument names a file of a graph: by its ending, of a ``.json`` by its content.

    Examples
    --------
    >>> is_graph_file("roads.graphml"), is_graph_file("paper"), is_graph_file("zones.geojson")
    (True, False, False)
    """
    path = Path(spec)
    kind = path.suffix.lower()
    if kind != ".json":
        return kind in ENDINGS
    try:
        text = read_text(path, spec, ENDINGS[kind]) if path.stat().st_size <= MOST_TEXT else ""
        # (of large files of zones, this is all that is looked at)
        found = json.loads(text) if '"nodes"' in text else None
    except (ScenarioError, OSError, ValueError, RecursionError, MemoryError):
        return False
    return isinstance(found, dict) and "nodes" in found
