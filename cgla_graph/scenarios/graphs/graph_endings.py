"""Recognition of graph files by their endings, without importing the code that reads graphs."""

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
    Return whether an argument names a graph file: by its ending, and for ``.json`` by its content.

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
        # (large zone files are not parsed)
        found = json.loads(text) if '"nodes"' in text else None
    except (ScenarioError, OSError, ValueError, RecursionError, MemoryError):
        return False
    return isinstance(found, dict) and "nodes" in found
