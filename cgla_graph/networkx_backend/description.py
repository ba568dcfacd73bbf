"""Description of the backend, which networkx reads when it is imported; it imports nothing itself."""

from typing import Any

#: The functions of `cgla_graph.networkx_backend.functions` that networkx may call.
FUNCTIONS = (
    "all_pairs_dijkstra",
    "all_pairs_dijkstra_path",
    "all_pairs_dijkstra_path_length",
    "all_pairs_shortest_path",
    "all_pairs_shortest_path_length",
    "bidirectional_dijkstra",
    "bidirectional_shortest_path",
    "dijkstra_path",
    "dijkstra_path_length",
    "has_path",
    "multi_source_dijkstra",
    "multi_source_dijkstra_path",
    "multi_source_dijkstra_path_length",
    "shortest_path",
    "shortest_path_length",
    "single_source_dijkstra",
    "single_source_dijkstra_path",
    "single_source_dijkstra_path_length",
    "single_source_shortest_path",
    "single_source_shortest_path_length",
    "single_target_shortest_path",
    "single_target_shortest_path_length",
)


def backend_info() -> dict[str, Any]:
    """
    Return networkx's description of the backend (entry point ``networkx.backend_info``).

    Examples
    --------
    >>> backend_info()["backend_name"]
    'cgla'
    """
    note = "Weights are numbers of at least 0, given by the name of their attribute. With ties, any optimal path."
    return {
        "backend_name": "cgla",
        "project": "cgla-graph",
        "package": "cgla_graph",
        "short_summary": "Shortest paths over geometric graphs; complete graphs are never held in memory.",
        "functions": {name: {"additional_docs": note} for name in FUNCTIONS},
    }
