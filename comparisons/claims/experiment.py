"""An experiment: what is measured on each map of the panel, for one or more claims."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from cgla_graph.comparisons.claims.panel.settings import PANEL, Kind, Panel, PanelMap, seeds_of

#: One measurement: plain names with numbers, words, truth values or None (unknown, or not finite).
Record: TypeAlias = Mapping[str, Any]
Sample: TypeAlias = Callable[[PanelMap], Sequence[Record]]
#: Some kinds of maps of a panel.
Kinds: TypeAlias = Callable[[Panel], Sequence[Kind]]


def all_kinds(panel: Panel) -> Sequence[Kind]:
    """Return all kinds of maps of a panel."""
    return panel.kinds


def on_diagonal(panel: Panel) -> Sequence[Kind]:
    """Return the kinds whose goal is on the diagonal, for what does not depend on the goal."""
    return [kind for kind in panel.kinds if kind.goal == "diagonal"]


@dataclass(frozen=True)
class Experiment:
    """
    What is measured on a map.

    Attributes
    ----------
    name
        Kebab-case.
    sample
        Measures on a map, in all its cells: a list of records, each with the settings that name its case (such as
        ``radius``, ``k``, ``planner``) and the measurements. At top level of its module; the same map gives the same
        records.
    kinds, share
        On which kinds of maps, and on what share of them: below 1 where a map takes long.
    quick
        On how many maps of each kind with ``--quick``.

    Examples
    --------
    >>> Experiment("squares", lambda map_: [{"value": map_.seed**2}], quick=1).seeds(3, 40, quick=True)[:2]
    [3000000, 3010000]
    """

    name: str
    sample: Sample
    kinds: Kinds = all_kinds
    quick: int = 1
    share: float = 1.0

    def count(self, maps: int, *, quick: bool = False) -> int:
        """Return on how many maps of each kind it measures, where so many are asked for."""
        return min(self.quick, maps) if quick else max(1, round(self.share * maps))

    def seeds(self, seed: int, maps: int, *, quick: bool, panel: Panel = PANEL) -> list[int]:
        """Return the seeds of its maps in the study of a seed, with so many of each kind."""
        count = self.count(maps, quick=quick)
        return [one for kind in self.kinds(panel) for one in seeds_of(kind, seed, count, panel)]


def experiment(
    name: str, *, kinds: Kinds = all_kinds, quick: int = 1, share: float = 1.0
) -> Callable[[Sample], Experiment]:
    """
    Make an experiment of the function that measures on a map, which stands below; what is given is as of `Experiment`.

    Examples
    --------
    >>> @experiment("squares", quick=3)
    ... def squares(map_: PanelMap) -> list[Record]:
    ...     return [{"value": map_.seed**2}]
    >>> squares.sample(PanelMap(4))
    [{'value': 16}]
    """
    return lambda sample: Experiment(name, sample, kinds, quick, share)
