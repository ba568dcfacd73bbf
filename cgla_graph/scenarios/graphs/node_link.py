"""Reader of networkx's node-link JSON, as its versions 1 to 3 and other programs write it."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import cast

from cgla_graph._text import cut, listed, shown
from cgla_graph.model.adjacency import Node, label_text
from cgla_graph.scenarios.graphs.edge_list import EdgeList, fail, read_weight
from cgla_graph.untrusted.json_files import json_value

#: Limits of a document: 200 MB of edges have fewer.
_MOST_OBJECTS, _MOST_LISTS = 10_000_000, 20_000_000
#: Keys of an edge that hold no attribute.
_NO_ATTRIBUTES = {"source", "target", "key"}
#: Stands for the weight of an edge that has none; null is a wrong one.
_MISSING = object()


def read_node_link(path: Path, text: str, weight: str) -> tuple[EdgeList, bool, list[Mapping[str, object]]]:
    """
    Read the text of node-link JSON: lists of ``nodes``, and of ``edges`` or ``links`` with weights under a key.

    Returns
    -------
    edges, directed, attributes
        The edges, whether they lead one way, and the objects of the nodes.

    Raises
    ------
    ScenarioError
        If a list is missing, a node or an edge is malformed, or an edge has no weight.
    FileFormatError
        If it is no JSON (see `cgla_graph.untrusted.json_files.json_of`).
    """
    document = json_value(text, str(path), most_objects=_MOST_OBJECTS, most_lists=_MOST_LISTS, infinite=True)
    lists = {
        name: document[name]
        for name in ("nodes", "edges", "links")
        if isinstance(document, dict) and isinstance(document.get(name), list)
    }
    if not isinstance(document, dict) or "nodes" not in lists or len(lists) == 1:
        fail(path, "it has no lists nodes and edges (or links)", "write it as networkx.node_link_data gives it")
    nodes, links = lists["nodes"], lists.get("links") or lists.get("edges") or []
    if lists.get("edges") and lists.get("links") and lists["edges"] != lists["links"]:
        fail(path, "it has both edges and links, and they differ", "leave one of the lists out")
    edges = EdgeList(path)
    for number, node in enumerate(nodes):
        if not isinstance(node, dict):
            fail(path, f"entry {number} of nodes is {_json(node)}", "give an object with an id")
        label = _label(path, node.get("id", number), f"entry {number} of nodes has the id")
        if edges.labels.setdefault(label, number) != number:
            fail(path, f"nodes {edges.labels[label]} and {number} have the id {_json(label)}", "list each node once")
    default = _default(document.get("graph"), weight)
    for number, (link, tail, head) in enumerate(_joined(path, links, edges.labels, document.get("graph"))):
        value = link.get(weight, default)
        # (most weights are floats, and the text of the edge is for errors)
        if type(value) is not float or not value >= 0.0:
            edge = f"the edge from {_end(link, 'source')} to {_end(link, 'target')}"
            if value is _MISSING:
                there = [shown(key) for key in link if key not in _NO_ATTRIBUTES]
                hint = f"it has {listed(there)}: name one (--weight)" if there else "give each edge one"
                fail(path, f"{edge} (entry {number}) has no {shown(weight)}", hint)
            value = read_weight(path, edge, value, _json(value))
        edges.add(tail, head, value)
    return edges, _directed(path, document.get("directed")), nodes


def _label(path: Path, given: object, what: str) -> Node:
    """Return an id as a node: lists become tuples, as networkx has it."""
    if isinstance(given, list):
        return tuple(_label(path, part, what) for part in given)
    if given is None or isinstance(given, dict) or given != given:  # noqa: PLR0124 - NaN
        fail(path, f"{what} {_json(given)}, which cannot be a node", "give text, a number or a list of them")
    return given


def _joined(
    path: Path, links: Sequence[object], labels: Mapping[Node, int], graph: object
) -> Iterator[tuple[dict[str, object], int, int]]:
    """
    Yield each edge with the indices of its ends.

    An edge names its ends by their ids. Version 1 of networkx, whose ``graph`` is a list, counts their places in the
    list of nodes instead.
    """
    ends: list[tuple[Node, Node]] = []
    for number, link in enumerate(links):
        if not isinstance(link, dict) or not {"source", "target"} <= link.keys():
            fail(path, f"entry {number} of edges is {_json(link)}", "give an object with source and target")
        what = f"entry {number} of edges has the end"
        ends.append((_label(path, link["source"], what), _label(path, link["target"], what)))
    unknown = next((end for pair in ends for end in pair if end not in labels), None)
    if isinstance(graph, list) and all(type(end) is int and 0 <= end < len(labels) for pair in ends for end in pair):
        # (an id that is the place of its node can be read either way)
        if unknown is None and any(labels[end] != end for pair in ends for end in pair):
            wrong = "its graph is a list, as of networkx 1, which counts nodes, but the ends of edges are ids as well"
            fail(path, wrong, "write it anew with networkx 2 or later, or replace the list by {}")
        labels, unknown = {place: place for place in range(len(labels))}, None
    if unknown is not None:
        fail(path, f"edges end in {_json(unknown)}, which is no id of its {len(labels)} nodes", "list it in nodes")
    for link, (tail, head) in zip(links, ends, strict=True):
        yield cast("dict[str, object]", link), labels[tail], labels[head]


def _default(graph: object, weight: str) -> object:
    """Return the weight of edges that have none of their own, which networkx takes over from GraphML, or `_MISSING`."""
    defaults = graph.get("edge_default") if isinstance(graph, dict) else None
    return defaults.get(weight, _MISSING) if isinstance(defaults, dict) else _MISSING


def _directed(path: Path, given: object) -> bool:
    """Return whether edges lead one way; they do not where nothing is said."""
    said = given.strip().lower() if isinstance(given, str) else given
    truth = said if said is None or isinstance(said, bool) else {"true": True, "false": False}.get(str(said))
    if truth is None and said is not None:
        fail(path, f"its directed is {_json(given)}", "write true or false")
    return bool(truth)


def _end(link: Mapping[str, object], name: str) -> str:
    return label_text(link[name])


def _json(value: object) -> str:
    """Write a value as its file has it."""
    return cut(json.dumps(value, ensure_ascii=False, default=repr))
