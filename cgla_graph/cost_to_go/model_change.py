"""The difference of two cost models: which weights a change may have altered, and in which direction."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.risk import Threat
from cgla_graph.model.risk_kernels import reach_class

#: No boxes.
NOWHERE = np.empty((0, 4))


@dataclass(frozen=True, eq=False)
class ModelChange:
    """
    The difference of an old and a new cost model.

    Attributes
    ----------
    everything
        Whether every weight may differ: `k` or the rasters changed, or the reach of all threats, which depends on their
        number and on how faint a risk matters (see `risk_kernels.reach_class` and `unit_of`).
    unrelated
        Whether old values bound no new ones: the rasters changed, or the threats that stayed reach less far.
    weights_only_grow
        Whether no weight fell: no threat or area is gone, and `k` did not fall.
    came, gone
        Rows of `RiskField.table` of the threats that only the new or only the old model has, shapes ``(m, 7)``; of a
        repeated threat, as many rows as one model has more than the other. A threat that moved is in both.
    opened
        Boxes ``x_min, y_min, x_max, y_max`` of the no-fly polygons that are gone and that no new one covers, shape
        ``(b, 4)``, map units.
    redrawn
        Boxes of all no-fly polygons that came or went, in the same form.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> one, two = Threat(0.2, 0.2, spread=0.1), Threat(0.7, 0.6, spread=0.1)
    >>> change = ModelChange.between(CostModel(RiskField([one]), k=1.0), CostModel(RiskField([two, one]), k=1.0))
    >>> len(change.came), len(change.gone), change.weights_only_grow, change.everything
    (1, 0, True, False)
    """

    everything: bool
    unrelated: bool
    weights_only_grow: bool
    came: FloatArray
    gone: FloatArray
    opened: FloatArray
    redrawn: FloatArray

    @classmethod
    def between(cls, old: CostModel, new: CostModel) -> "ModelChange":
        """Compare two models."""
        # (how far threats reach)
        reach, reach_now = (reach_class(len(model.field)) / model.field.unit for model in (old, new))
        before, after = Counter(old.field.threats), Counter(new.field.threats)
        gone = _rows(old, before - after)
        opened, redrawn = _redrawn(old, new)
        same = old.field.rasters == new.field.rasters
        grew = same and new.k >= old.k and reach_now >= reach
        return cls(
            everything=not same or old.k != new.k or reach != reach_now,
            unrelated=not same or reach_now < reach,
            weights_only_grow=grew and not len(gone) and not len(opened),
            came=_rows(new, after - before),
            gone=gone,
            opened=opened,
            redrawn=redrawn,
        )

    @property
    def threats(self) -> FloatArray:
        """Rows of all threats that came or went, shape ``(m, 8)``."""
        return np.vstack([self.came, self.gone])


def _rows(model: CostModel, surplus: Counter[Threat]) -> FloatArray:
    """Return the rows of the surplus threats in the model's table, each as often as it counts; empties the surplus."""
    chosen: list[int] = []
    for index, threat in enumerate(model.field.threats):
        if surplus[threat] > 0:
            surplus[threat] -= 1
            chosen.append(index)
    return model.field.table[chosen]


def _redrawn(old: CostModel, new: CostModel) -> tuple[FloatArray, FloatArray]:
    """Return the boxes of the no-fly polygons that opened up, and of all that came or went."""
    if old.area is new.area or (old.area.is_empty and new.area.is_empty):
        return NOWHERE, NOWHERE
    before, after = (
        {shapely.to_wkb(part.normalize()): part for part in shapely.get_parts(model.area.geometry)}
        for model in (old, new)
    )
    went = [part for key, part in before.items() if key not in after]
    came = [part for key, part in after.items() if key not in before]
    opened = [part for part in went if not shapely.covers(new.area.geometry, part)]
    return _boxes(opened), _boxes(went + came)


def _boxes(parts: list[BaseGeometry]) -> FloatArray:
    return np.ascontiguousarray(shapely.bounds(parts)) if parts else NOWHERE
