"""Lemma 1 and Theorem 1 as an assertion for tests."""

from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.cost_to_go.theorem_1 import TheoremCheck, check_theorem_1
from cgla_graph.model.adjacency import Node
from cgla_graph.model.graph import GeometricGraph

_ASSUMED = "every node reaches the target"


def assert_theorem_1(
    graph: GeometricGraph, target: Node, source: Node | None = None, *, matrix: CostMatrix | None = None
) -> TheoremCheck:
    """
    Assert Lemma 1 and the parts of Theorem 1 on a graph; the error names the witness of each statement that fails.

    Nodes that cannot reach the target are no failure: they keep G = infinity. A statement that could not be checked,
    because the graph is too large, is one.

    Parameters
    ----------
    graph, target, source, matrix
        As `cgla_graph.check_theorem_1` takes them.

    Returns
    -------
    checked
        The check, with its cost matrix.

    Raises
    ------
    AssertionError
        If a weight is below 0, or a statement fails or is not checked.
    NodeNotFoundError, GraphError
        As from `cgla_graph.check_theorem_1`.

    Examples
    --------
    >>> roads = GeometricGraph.from_matrix([[0, 2, 5], [2, 0, 1], [5, 1, 0]], labels=["depot", "bridge", "tower"])
    >>> assert_theorem_1(roads, "tower").matrix.path_from("depot")
    ['depot', 'bridge', 'tower']
    """
    checked = check_theorem_1(graph, target, source, matrix=matrix)
    reached = source is None or checked.matrix is None or checked.matrix.value(source) < float("inf")
    faults = []
    for one in checked.statements:
        unreached = one.name == _ASSUMED or (one.name.startswith("Theorem 1 (3)") and not reached)
        if one.needed and one.holds is not True and not unreached:
            at = f", at {', '.join(map(repr, one.witness))}" if one.witness else ""
            when = f", in round {one.round}" if one.round else ""
            faults.append(f"{one.name}{at}{when}: {one.says}")
    if faults:
        msg = "Theorem 1 does not hold:\n" + "\n".join(faults)
        raise AssertionError(msg)
    return checked
