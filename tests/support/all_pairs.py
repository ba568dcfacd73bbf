"""All solvers against each other: what tables and rankings are held against."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

from cgla_graph.comparisons.statistics.paired import Paired, compare_costs, holm


def all_pairs(costs: Mapping[str, Sequence[float]]) -> list[Paired]:
    """Compare each pair once, the earlier one with the later as reference, with p-values adjusted to all of them."""
    found = [compare_costs(a, costs[a], b, costs[b]) for a, b in combinations(costs, 2)]
    adjusted = holm([one.p for one in found])
    return [replace(one, p_holm=p) for one, p in zip(found, adjusted, strict=True)]
