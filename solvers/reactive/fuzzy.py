"""Fuzzy inference by composition: triangular sets, rules as a fuzzy relation, sup-min composition, centroid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import number_array
from cgla_graph.errors import SolverSettingError

#: Left foot, peak and right foot of a triangular set; an infinite foot makes a shoulder, equal ones a vertical side.
Triangle: TypeAlias = tuple[float, float, float]

CORNERS = 3


def triangles(sets: ArrayLike) -> FloatArray:
    """
    Check triangular sets.

    Parameters
    ----------
    sets
        Left foot, peak and right foot of each, shape ``(..., 3)``.

    Returns
    -------
    sets
        As floats.

    Raises
    ------
    SolverSettingError
        If one has other than three numbers, a peak that is not finite, or a foot beyond its peak.

    Examples
    --------
    >>> triangles([[-np.inf, 0, 1], [0, 1, 2]]).shape
    (2, 3)
    """
    found = number_array("sets", sets)
    if found.ndim == 0 or found.shape[-1] != CORNERS:
        msg = f"fuzzy sets have shape {found.shape}; give (left foot, peak, right foot) of each, shape (..., 3)"
        raise SolverSettingError(msg)
    left, peak, right = np.moveaxis(found, -1, 0)
    # a comparison with NaN is false
    bad = ~((left <= peak) & (peak <= right) & np.isfinite(peak))
    if bad.any():
        one = found[bad][0].tolist()
        msg = f"the fuzzy set {one} is no triangle; its left foot, finite peak and right foot must not fall"
        raise SolverSettingError(msg)
    return found


def membership(values: ArrayLike, sets: ArrayLike) -> FloatArray:
    """
    Say how far values belong to sets.

    Parameters
    ----------
    values
        Shape ``(m,)``.
    sets
        Shape ``(n, 3)``.

    Returns
    -------
    grades
        In [0, 1], shape ``(n, m)``: 1 at the peak, falling in a straight line to 0 at a foot; beyond the peak on the
        side of an infinite foot, 1.

    Raises
    ------
    SolverSettingError
        If a set is no triangle.

    Examples
    --------
    >>> membership([-5, 0, 0.25, 1], [(-np.inf, 0, 1)]).tolist()
    [[1.0, 1.0, 0.75, 0.0]]
    """
    points = number_array("values", values)[None, :]
    return possibility(np.stack([points] * CORNERS, axis=-1), triangles(sets)[:, None, :])


def possibility(first: FloatArray, second: FloatArray) -> FloatArray:
    """
    Say how far sets can agree: the greatest height where both overlap, ``sup_x min(A(x), B(x))``.

    Parameters
    ----------
    first, second
        Triangular sets, shapes ``(..., 3)`` that broadcast; they are not checked.

    Returns
    -------
    grades
        In [0, 1], shape ``(...)``.

    Notes
    -----
    Where the peaks differ, the height is that of the crossing of the facing sides: with the gap between the peaks
    ``g`` and the facing sides ``u`` and ``v`` wide, ``1 - g / (u + v)``.

    Examples
    --------
    >>> possibility(np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0, 3.0])).item()
    0.5
    """
    gap = second[..., 1] - first[..., 1]
    rightward = (first[..., 2] - first[..., 1]) + (second[..., 1] - second[..., 0])
    leftward = (first[..., 1] - first[..., 0]) + (second[..., 2] - second[..., 1])
    facing = np.where(gap > 0.0, rightward, leftward)
    # two vertical sides that face each other meet nowhere, but in the same place
    share = np.abs(gap) / np.where(facing > 0.0, facing, 1.0)
    apart = (facing <= 0.0) & (gap != 0.0)
    return np.where(apart, 0.0, np.maximum(1.0 - share, 0.0))


def about(values: ArrayLike, widths: ArrayLike) -> FloatArray:
    """
    Blur measured values into sets: "about x".

    Parameters
    ----------
    values, widths
        Shape ``(m,)`` each; a width of 0 leaves the value crisp.

    Returns
    -------
    sets
        Shape ``(m, 3)``.

    Raises
    ------
    SolverSettingError
        If a value is not finite or a width is below 0.

    Examples
    --------
    >>> about([5], [1]).tolist()
    [[4.0, 5.0, 6.0]]
    """
    centres, half = number_array("values", values), number_array("widths", widths)
    return triangles(np.stack([centres - half, centres, centres + half], axis=-1))


@dataclass(frozen=True, eq=False)
class RuleBase:
    """
    Rules "if x1 is A1 and x2 is A2 ... then y is B", as one fuzzy relation.

    The relation is the union of the rules, ``R(x, y) = max_r min(A_r1(x1), A_r2(x2), ..., w_r, B_r(y))`` (Mamdani),
    and the conclusion from the inputs A' is their composition with it (Zadeh's compositional rule of inference),
    ``B'(y) = sup_x min(A'(x), R(x, y))``.

    Attributes
    ----------
    conditions
        The sets of each rule for each input, shape ``(n, m, 3)``.
    conclusions
        The set of each rule for the output, shape ``(n, 3)``.
    grid
        The values of the output that conclusions are computed on, shape ``(g,)``.
    weights
        How far each rule holds, in [0, 1], shape ``(n,)``; None: all hold fully.

    Raises
    ------
    SolverSettingError
        If the shapes do not fit, a set is no triangle or a weight is out of range.

    Examples
    --------
    Two rules, "if cold then heat much" and "if warm then heat little": halfway, both hold half.

    >>> cold, warm, little, much = (-np.inf, 0, 20), (0, 20, np.inf), (-1, 0, 1), (9, 10, 11)
    >>> base = RuleBase([[cold], [warm]], [much, little], grid=np.linspace(-1, 11, 121))
    >>> round(base.decide(about([10], [0])), 9)
    5.0
    """

    conditions: ArrayLike
    conclusions: ArrayLike
    grid: ArrayLike
    weights: ArrayLike | None = None

    def __post_init__(self) -> None:
        """Check the shapes and the sets."""
        conditions, conclusions = triangles(self.conditions), triangles(self.conclusions)
        grid = number_array("grid", self.grid)
        weights = np.ones(len(conclusions)) if self.weights is None else number_array("weights", self.weights)
        if conditions.ndim != 3 or conclusions.shape != (len(conditions), CORNERS) or grid.ndim != 1:  # noqa: PLR2004
            msg = (
                f"a rule base of conditions {conditions.shape}, conclusions {conclusions.shape} and a grid {grid.shape}"
                "; give shapes (rules, inputs, 3), (rules, 3) and (points,)"
            )
            raise SolverSettingError(msg)
        if weights.shape != (len(conclusions),) or not ((weights >= 0.0) & (weights <= 1.0)).all():
            msg = f"the weights of {len(conclusions)} rules are {weights.tolist()}; give each rule one in [0, 1]"
            raise SolverSettingError(msg)
        for name, value in (
            ("conditions", conditions),
            ("conclusions", conclusions),
            ("grid", grid),
            ("weights", weights),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_table(
        cls,
        inputs: Sequence[Mapping[str, Triangle]],
        output: Mapping[str, Triangle],
        table: Mapping[tuple[str, ...], str],
        grid: ArrayLike,
    ) -> "RuleBase":
        """
        Build the rules from a table of words.

        Parameters
        ----------
        inputs
            The sets of each input by name.
        output
            The sets of the output by name.
        table
            A name of a set of each input to a name of a set of the output.
        grid
            The values of the output that conclusions are computed on, shape ``(g,)``.

        Raises
        ------
        SolverSettingError
            If the table names a set that is not there.

        Examples
        --------
        >>> heat = {"cold": (-np.inf, 0, 20), "warm": (0, 20, np.inf)}
        >>> power = {"little": (-1, 0, 1), "much": (9, 10, 11)}
        >>> table = {("cold",): "much", ("warm",): "little"}
        >>> base = RuleBase.from_table([heat], power, table, np.linspace(-1, 11, 121))
        >>> round(base.decide(about([0], [0])), 9)
        10.0
        """
        conditions, conclusions = [], []
        for words, conclusion in table.items():
            if len(words) != len(inputs):
                msg = f"the rule {words} has {len(words)} conditions; there are {len(inputs)} inputs"
                raise SolverSettingError(msg)
            conditions.append([_named(word, sets) for word, sets in zip(words, inputs, strict=True)])
            conclusions.append(_named(conclusion, output))
        return cls(np.reshape(conditions, (-1, len(inputs), CORNERS)), np.reshape(conclusions, (-1, CORNERS)), grid)

    @cached_property
    def _on_grid(self) -> FloatArray:
        """The conclusions on the grid, shape ``(n, g)``."""
        return membership(self.grid, self.conclusions)

    def strengths(self, inputs: FloatArray) -> FloatArray:
        """
        Say how far each rule fires.

        Parameters
        ----------
        inputs
            The fuzzy inputs A', shape ``(m, 3)``.

        Returns
        -------
        grades
            In [0, 1], shape ``(n,)``.

        Notes
        -----
        The inputs do not interact, so that the supremum over all of them together is the least of the suprema over
        each one: no grid over the inputs is needed, and none of its error occurs.
        """
        conditions, weights = np.asarray(self.conditions), np.asarray(self.weights)
        met: FloatArray = np.minimum(possibility(inputs[None, :, :], conditions).min(axis=1, initial=1.0), weights)
        return met

    def conclude(self, inputs: FloatArray) -> FloatArray:
        """
        Compose inputs with the relation.

        Parameters
        ----------
        inputs
            The fuzzy inputs A', shape ``(m, 3)``.

        Returns
        -------
        conclusion
            B' on the grid, shape ``(g,)``; 0 everywhere if no rule fires. Of the union of two rule bases it is the
            greater of their two conclusions.
        """
        clipped = np.minimum(self.strengths(inputs)[:, None], self._on_grid)
        found: FloatArray = clipped.max(axis=0, initial=0.0)
        return found

    def decide(self, inputs: FloatArray) -> float:
        """
        Return the centroid of the conclusion.

        Raises
        ------
        SolverSettingError
            If no rule fires.
        """
        return centroid(np.asarray(self.grid), self.conclude(inputs))


def centroid(grid: FloatArray, conclusion: FloatArray) -> float:
    """
    Turn a fuzzy set on a grid into a number: its centre of gravity.

    Parameters
    ----------
    grid, conclusion
        Values, and how far each belongs to the set, shape ``(g,)`` each.

    Raises
    ------
    SolverSettingError
        If nothing belongs to the set.

    Examples
    --------
    >>> centroid(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 1.0]))
    1.5
    """
    total = float(conclusion.sum())
    if total <= 0.0:
        msg = "no rule fires: the rules do not cover the input; add one that does"
        raise SolverSettingError(msg)
    return float(grid @ conclusion) / total


def _named(word: str, sets: Mapping[str, Triangle]) -> Triangle:
    if word not in sets:
        msg = f"a rule names the set {shown(word)}; the sets are {', '.join(sets)}"
        raise SolverSettingError(msg)
    return sets[word]
