"""What a check has to go by: how much is asked for, random numbers, and the samples of experiments."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.settings import MAPS, MAPS_A_SEED, PANEL, Panel, PanelMap, seeds_of


@dataclass(frozen=True)
class Scale:
    """
    How much is asked for.

    Attributes
    ----------
    maps, quick
        Maps of each kind, and so in each cell; whether to look at a few only.
    seed
        Of everything that is drawn, at least 0.
    panel
        The settings: those of the study, or a user's own.
    """

    maps: int = MAPS
    seed: int = 1
    quick: bool = False
    panel: Panel = PANEL

    def map_seeds(self, count: int) -> range:
        """Return the seeds of so many maps."""
        return range(MAPS_A_SEED * self.seed, MAPS_A_SEED * self.seed + count)


@dataclass(frozen=True)
class Samples:
    """
    What an experiment measured: records of all maps and cases.

    Attributes
    ----------
    records, failed
        Each with the entry ``map``, the seed of its map; of maps that told nothing, why.

    Examples
    --------
    >>> samples = Samples([{"map": 1, "k": 10, "risk": 2.0}, {"map": 1, "k": 50, "risk": 1.0}, {"map": 2, "k": 50}])
    >>> samples.cases("k"), samples.column("risk", k=50)
    ([{'k': 10}, {'k': 50}], array([ 1., nan]))
    """

    records: Sequence[Record]
    failed: Mapping[int, str] = field(default_factory=dict)

    def cases(self, *names: str) -> list[dict[str, Any]]:
        """List the different values of some entries, in the order in which they first come up."""
        found = {tuple(record.get(name) for name in names): None for record in self.records}
        return [dict(zip(names, values, strict=True)) for values in found]

    def where(self, **case: object) -> list[Record]:
        """Return the records of one case."""
        found = list(self.records)
        # one entry after the other: most records are dropped by the first
        for name, value in case.items():
            found = [record for record in found if record.get(name) == value]
        return found

    def column(self, name: str, **case: object) -> FloatArray:
        """
        Return one measurement in one case, shape ``(m,)``, in the order of seeds; truth is 1, what is missing NaN.

        Raises
        ------
        ValueError
            If a map has several records of the case.
        """
        values = dict.fromkeys(sorted({int(record["map"]) for record in self.records}), math.nan)
        found = self.where(**case)
        if len({record["map"] for record in found}) < len(found):
            msg = f"a map has several records of the case {case}; say more of it"
            raise ValueError(msg)
        values |= {record["map"]: math.nan if record.get(name) is None else float(record[name]) for record in found}
        return np.array(list(values.values()))


@dataclass(frozen=True)
class Evidence:
    """What a check has to go by: how much is asked for, and the samples of its experiments, by name."""

    scale: Scale = field(default_factory=Scale)
    samples: Mapping[str, Samples] = field(default_factory=dict)

    def instances(self, full: int, quick: int) -> int:
        """Return how many random instances of its own a check goes through; `full` is for `MAPS` maps a cell."""
        return quick if self.scale.quick else max(1, round(full * self.scale.maps / MAPS))

    @property
    def panel(self) -> Panel:
        """The settings in which the claim is checked."""
        return self.scale.panel

    def maps(self, each: int) -> list[PanelMap]:
        """Return so many maps of each kind of the panel, for a check that measures on its own."""
        kinds = self.panel.kinds
        seeds = [seed for kind in kinds for seed in seeds_of(kind, self.scale.seed, each, self.panel)]
        return [PanelMap(seed, self.panel) for seed in seeds]

    def rng(self, purpose: str) -> np.random.Generator:
        """Return random numbers for a purpose, the same ones every time."""
        words = hashlib.sha256(purpose.encode()).digest()[:8]
        return np.random.default_rng([self.scale.seed, int.from_bytes(words)])
