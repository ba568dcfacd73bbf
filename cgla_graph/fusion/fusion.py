"""
Weights from the knowledge of several UAVs: readings of Eq. 5's ``max_j`` and of its line integral.

Eq. 5 weighs a segment with ``length + k max_j (integral of F^j)``, where ``F^j`` is the field that UAV ``j`` knows. The
paper also says that the UAVs plan on all threats detected by any of them, and that the map is updated by "the UAV of
the maximum risk value". `Fusion` names the possible readings. For every segment

``max_integral <= integral_max <= union <=`` the sum of the integrals of all ``F^j``.

Only `union` and `integral_max` are integrals of a field, and so add up over the pieces of a segment; with
`max_integral`, a segment may cost less than its two halves.
"""

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._threads import share_out
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import non_negative_number, point_array, whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.fusion import envelope_kernels, fusion_kernels
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField, Threat

#: How the fields of several UAVs make one weight. ``union``: the integral of one field of all known threats (Eqs 1, 2);
#: ``max_integral``: the largest of the integrals (Eq. 5 to the letter); ``integral_max``: the integral of the largest
#: field; ``riskiest``: the integral of the one field whose integrals are the largest in total, for all segments.
Fusion: TypeAlias = Literal["union", "max_integral", "integral_max", "riskiest"]
#: How a field is integrated. ``exact``: as `RiskField.line_integral`; ``raster``: summed up over the far ends of equal
#: parts of the segment, which weighs the two directions of a segment differently.
Integral: TypeAlias = Literal["exact", "raster"]

#: Upper limit of the parts of a segment.
MOST_SAMPLES = 10**6

#: Fields whose pointwise maximum is integrated.
Group: TypeAlias = tuple[RiskField, ...]


def fused_weights(
    starts: ArrayLike,
    ends: ArrayLike,
    fields: Sequence[RiskField],
    k: float = 0.0,
    no_fly: BaseGeometry | None = None,
    *,
    fusion: Fusion = "union",
    integral: Integral = "exact",
    samples: int = 50,
) -> FloatArray:
    """
    Weigh segments by Eq. 5 with the fields of several UAVs; infinity where one crosses the no-fly area.

    Parameters
    ----------
    starts, ends
        The segments' ends, both of shape ``(n, 2)``, map units.
    fields
        The field that each UAV knows; an empty list means no risk.
    k
        Risk weight, at least 0.
    no_fly
        Polygons that no segment may cross, or None.
    fusion, integral
        The reading of Eq. 5 (see `Fusion`, `Integral`). ``riskiest`` takes the field whose weights are the largest in
        total over the segments given, without those that cross the area; of equal ones the first.
    samples
        Parts of a segment for ``raster``, at least 1.

    Returns
    -------
    weights
        Shape ``(n,)``, map units. Exact risks are within 1e-9 on maps of unit size.

    Raises
    ------
    ProblemError
        If an array does not hold finite pairs, a field is not a proper `RiskField`, or a setting is unknown or out of
        range.

    Examples
    --------
    Two UAVs know one threat each. Over a segment past both, Eq. 5 to the letter counts only one of them.

    >>> known = [RiskField([Threat(0.2, 0, spread=0.01)]), RiskField([Threat(0.8, 0, spread=0.01)])]
    >>> [float(fused_weights([(0, 0)], [(1, 0)], known, 10, fusion=f)[0].round(3)) for f in ("max_integral", "union")]
    [1.251, 1.501]
    """
    known, k, parts = proper(fields), non_negative_number("k", k), _samples(integral, samples)
    lengths = CostModel(no_fly=no_fly).weights(starts, ends)
    first, second = point_array("starts", starts), point_array("ends", ends)

    def weigh(group: Group) -> FloatArray:
        if len(group) == 1 and not parts:
            return CostModel(group[0], k).weights(first, second)
        risks = np.empty(len(first))
        known_to = kernel_fields(group)
        share_out(
            lambda share, step: fusion_kernels.segment_risks(first, second, known_to, parts, share, step, risks),
            len(first),
        )
        return lengths + k * risks

    return _fused(lengths, _groups(known, fusion), weigh, fusion)


def fused_graph(
    points: Lattice | ArrayLike,
    fields: Sequence[RiskField],
    k: float = 0.0,
    no_fly: BaseGeometry | None = None,
    *,
    extra: Sequence[Point] = (),
    fusion: Fusion = "union",
    integral: Integral = "exact",
    samples: int = 50,
) -> GeometricGraph:
    """
    Join every pair of points by its straight segment, weighted by Eq. 5 with the fields of several UAVs.

    Parameters
    ----------
    points, extra
        The nodes, as `GeometricGraph.complete` takes them.
    fields, k, no_fly, fusion, integral, samples
        As in `fused_weights`. ``riskiest`` takes the field of the largest total over all edges.

    Returns
    -------
    graph
        With ``union`` and ``exact``, `GeometricGraph.complete` on the field of all known threats. Else a dense graph
        of weights, which has no cost model; directed if ``raster`` weighs the two directions of any pair differently.

    Raises
    ------
    ProblemError
        As `fused_weights`, or if `points` or `extra` are malformed.

    Examples
    --------
    >>> known = [RiskField([Threat(0.2, 0.5, 0.1)]), RiskField([Threat(0.8, 0.5, 0.1)])]
    >>> lattice = Lattice(5, bounds=(0, 0, 1, 1))
    >>> fused_graph(lattice, known, 10, fusion="max_integral").directed
    False
    >>> fused_graph(lattice, known, 10, integral="raster").directed
    True
    """
    known, k, parts = proper(fields), non_negative_number("k", k), _samples(integral, samples)
    groups = _groups(known, fusion)
    complete = GeometricGraph.complete(points, united(known), k, no_fly=no_fly, extra=extra)
    if (fusion == "union" and not parts) or complete.positions is None:
        return complete
    positions, lattice_shape = complete.positions, complete.lattice_shape
    lengths = CostModel(no_fly=no_fly).matrix(positions, lattice_shape)

    def weigh(group: Group) -> FloatArray:
        if len(group) == 1 and not parts:
            return CostModel(group[0], k).matrix(positions, lattice_shape)
        risks = np.empty(lengths.shape)
        known_to = kernel_fields(group)
        share_out(
            lambda share, step: fusion_kernels.pair_risks(positions, known_to, parts, share, step, risks),
            len(positions),
        )
        risks *= k
        risks += lengths
        return risks

    weights = _fused(lengths, groups, weigh, fusion)
    # the matrix knows nothing of the lattice, which solvers may ask for
    return dataclasses.replace(GeometricGraph.from_matrix(weights, positions=positions), lattice=complete.lattice)


def proper(fields: Sequence[RiskField]) -> Group:
    """
    Return the fields, or raise `ProblemError` unless each is proper; an empty list becomes one empty field.

    Examples
    --------
    >>> proper([])
    (RiskField(),)
    """
    if not isinstance(fields, Iterable):
        msg = f"fields are {shown(fields)}; give a list with the RiskField of each UAV"
        raise ProblemError(msg)
    known = tuple(fields)
    for number, field in enumerate(known):
        if not isinstance(field, RiskField):
            msg = f"field {number} is {shown(field)}; give the RiskField of each UAV"
            raise ProblemError(msg)
        if not field.is_proper:
            msg = f"field {number} has a peak above 1, where more threats may be less risk; lower it to (0, 1]"
            raise ProblemError(msg)
        if field.rasters:
            msg = (
                f"field {number} has rasters, which all UAVs know; the other readings of Eq. 5 are about threats alone"
            )
            raise ProblemError(msg)
    # no UAV has seen a threat: use one empty field
    return known or (RiskField(),)


def _samples(integral: str, samples: int) -> int:
    """Return the parts of a segment, 0 for the exact integral."""
    if integral not in get_args(Integral):
        msg = f"unknown integral {shown(integral)}; choose one of {', '.join(get_args(Integral))}"
        raise ProblemError(msg)
    parts = whole_number("samples", samples, at_least=1, at_most=MOST_SAMPLES)
    return parts if integral == "raster" else 0


def united(fields: Group) -> RiskField:
    """
    Return the union of fields as multisets of threats; this is one of `fields` if that has all threats.

    Examples
    --------
    >>> a, b = Threat(0.2, 0.5, 0.1), Threat(0.8, 0.5, 0.1)
    >>> len(united((RiskField([a]), RiskField([a, b]))))
    2
    """
    counts: Counter[Threat] = Counter()
    for field in fields:
        counts |= Counter(field.threats)
    for field in fields:
        # a field with all threats keeps their order, and so the last bits of its integrals
        if Counter(field.threats) == counts:
            return field
    return RiskField(counts.elements())


def _groups(fields: Group, fusion: str) -> list[Group]:
    """Split the fields into groups: the maximum of each group is integrated, and the integrals make one weight."""
    if fusion not in get_args(Fusion):
        msg = f"unknown fusion {shown(fusion)}; choose one of {', '.join(get_args(Fusion))}"
        raise ProblemError(msg)
    if fusion == "union":
        return [(united(fields),)]
    return [fields] if fusion == "integral_max" else [(field,) for field in fields]


def _fused(
    lengths: FloatArray, groups: list[Group], weigh: Callable[[Group], FloatArray], fusion: Fusion
) -> FloatArray:
    """Combine the groups' weights; `lengths` are infinite where a segment crosses the no-fly area."""
    edges = np.isfinite(lengths)
    # no weight is below its length, so that the maximum changes only what crosses
    fused, most = lengths, -np.inf
    for group in groups:
        weights = weigh(group)
        if fusion != "riskiest":
            fused = np.maximum(fused, weights)
        elif (total := float(weights.sum(where=edges))) > most:
            fused, most = np.maximum(lengths, weights), total
    return fused


def kernel_fields(group: Group) -> envelope_kernels.Fields:
    """Return fields as arrays for a kernel: the table of different threats, counts, all threats, and offsets."""
    counts = [Counter(field.threats) for field in group]
    different = list(dict.fromkeys(threat for field in group for threat in field.threats))
    return (
        np.array(RiskField(different).table),
        np.array([[count[threat] for threat in different] for count in counts], dtype=np.int64),
        np.concatenate([field.table for field in group]),
        np.cumsum([0, *(len(field) for field in group)]),
    )
