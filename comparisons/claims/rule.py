"""The rule that turns the records of a statement about flights into its answer, the same for all statements."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import Any, TypeAlias

import numpy as np

from cgla_graph._text import counted
from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Answer, Basis, Row, Table
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.panel.settings import Case
from cgla_graph.comparisons.claims.statement import Method, Share, Sign, Statement, Within
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE
from cgla_graph.comparisons.statistics.paired import holm

#: Below this a p-value counts.
ALPHA = 0.05
#: How many parts of the panel a row names at most.
MOST_NAMED = 2
#: The entry of a record that names the setting that is varied from a base cell.
VARIED = "varied"
#: The rule in words, made from what it judges by.
RULE = (
    f"A part of the panel is a level of one factor, a pair of levels of two factors, or a cell. In each part the "
    f"statement is tested on the maps of the part, each of which counts once. It holds if it is shown (p below "
    f"{ALPHA:g}) at every level of every factor, and the opposite is shown in no part (p below {ALPHA:g} after Holm's "
    "adjustment over all parts). It fails if the opposite holds in this sense. It depends if some parts show it, or "
    "the opposite, and others do not: they are named. Else it is open, as it is where the maps are too few for the "
    "opposite to be shown in a cell."
)

#: A part of the panel: fixed levels by factor.
Part: TypeAlias = tuple[tuple[str, Any], ...]
#: A cell, likewise, of all factors, the varied setting last.
Cell: TypeAlias = Part


@dataclass(frozen=True)
class Pairs:
    """
    The paired values of a statement in a cell, by map.

    Attributes
    ----------
    maps, first, second
        Seeds of the maps on which both values are there, and the values, shape ``(m,)`` each.
    asked
        How many maps there are with those on which a value is missing.
    """

    maps: Sequence[int]
    first: FloatArray
    second: FloatArray
    asked: int


def pairs_of(samples: Samples, statement: Statement) -> dict[Cell, Pairs]:
    """
    Pair the values of a statement in all cells of its part of the panel, the varied ones last.

    Examples
    --------
    >>> records = [{"map": i, "radius": 0.1, "k": k, "risk": 1.0 / k} for i in (1, 2) for k in (10.0, 50.0)]
    >>> statement = Statement("less", "risk", {"k": 50.0}, {"k": 10.0}, factors=("radius",))
    >>> [(cell, pairs.first) for cell, pairs in pairs_of(Samples(records), statement).items()]
    [((('radius', 0.1), ('varied', '')), array([0.02, 0.02]))]
    """
    first, bar = _by_cell(samples, statement, statement.first), statement.second
    second = {} if isinstance(bar, float) else _by_cell(samples, statement, bar)
    found = {}
    for cell in sorted(first, key=lambda cell: (bool(cell[-1][1]), *map(str, cell))):
        if not isinstance(bar, float) and cell not in second:
            # settings of another planner are varied here
            continue
        own = first[cell]
        other = dict.fromkeys(own, bar) if isinstance(bar, float) else second[cell]
        maps = sorted(own.keys() & other.keys())
        values = np.array([(own[one], other[one]) for one in maps], dtype=np.float64).reshape(-1, 2)
        both = np.flatnonzero(np.isfinite(values).all(axis=1))
        found[cell] = Pairs([maps[place] for place in both], values[both, 0], values[both, 1], len(maps))
    return found


def _by_cell(samples: Samples, statement: Statement, case: Case) -> dict[Cell, dict[int, float]]:
    names = [name for name in statement.factors if name not in statement.where]
    found: dict[Cell, dict[int, float]] = {}
    for record in samples.where(**{**statement.where, **case}):
        cell = (*((name, record.get(name)) for name in names), (VARIED, record.get(VARIED) or ""))
        values = found.setdefault(cell, {})
        if record["map"] in values:
            msg = f"several records of map {record['map']} are of {case} in {cell}; say more of the case"
            raise ValueError(msg)
        value = record.get(statement.measure)
        values[record["map"]] = math.nan if value is None else float(value)
    return found


@dataclass(frozen=True)
class Judged:
    """
    What the rule finds of a statement.

    Attributes
    ----------
    statement, cells
        The statement, and its values.
    tests
        The test of each part of the panel, as stated: 1 is for the statement.
    """

    statement: Statement
    cells: Mapping[Cell, Pairs]
    tests: Mapping[Part, Sign]

    @property
    def levels(self) -> list[Part]:
        """The parts at which a statement that holds is shown: each level of each factor, each varied setting."""
        return [part for part in self.tests if len(part) == 1] or list(self.tests)

    def _after_holm(self, direction: int) -> list[Part]:
        """Return the parts in which a direction is shown after Holm's adjustment over all parts."""
        parts = list(self.tests)
        adjusted = holm([self.tests[one].p if self.tests[one].direction == direction else 1.0 for one in parts])
        return [part for part, p in zip(parts, adjusted, strict=True) if p < ALPHA]

    @cached_property
    def shown(self) -> list[Part]:
        """Parts in which the statement is shown, adjusted."""
        return self._after_holm(1)

    @cached_property
    def opposed(self) -> list[Part]:
        """Parts in which the opposite is shown, adjusted."""
        return self._after_holm(-1)

    @property
    def _needed(self) -> int:
        """How many maps a cell needs before it can show the opposite after Holm's adjustment over all parts."""
        least = ALPHA / max(1, len(self.tests))
        if isinstance(self.statement.test, Share):
            # if it happens on none of them
            return math.ceil(math.log(least) / math.log(1.0 - self.statement.test.bar))
        return math.floor(1.0 - math.log2(least)) + 1

    @property
    def unseen(self) -> list[Cell]:
        """Cells with too few maps on which both values are there; for shares, pooled levels have to do."""
        if isinstance(self.statement.test, Share | Within):
            return []
        return [cell for cell, pairs in self.cells.items() if len(pairs.maps) < self._needed]

    @property
    def is_small(self) -> bool:
        """Whether the sample is too small for an answer, however many of its flights arrive."""
        return not self.cells or any(pairs.asked < self._needed for pairs in self.cells.values())

    @property
    def answer(self) -> Answer:
        """The answer, by the `RULE`."""
        shown, opposed = self.shown, self.opposed
        if self.is_small and not (shown and opposed):
            return Answer.OPEN
        for direction, against, answer in ((1, opposed, Answer.HOLDS), (-1, shown, Answer.FAILS)):
            at_levels = bool(self.tests) and all(self._is_shown(one, direction) for one in self.levels)
            if at_levels and not against and not self.unseen:
                return answer
        return Answer.DEPENDS if shown or opposed else Answer.OPEN

    @property
    def where(self) -> str:
        """In which parts the statement holds, fails, or is open, where it depends; else how much was looked at."""
        if self.answer is not Answer.DEPENDS:
            return "" if self.answer is not Answer.OPEN or not self.is_small else "too few maps to say"
        shown, against = ([one for one in self.levels if self._is_shown(one, sign)] for sign in (1, -1))
        if not (shown or self.shown) and 2 * len(against) > len(self.levels):
            rest = [one for one in self.levels if one not in against]
            return f"fails, but {'; '.join(filter(None, [_named('open', rest), self._unseen_words]))}"
        opposed = _largest(self.opposed)
        rest = [one for one in self.levels if one not in shown and one not in opposed]
        found = [_named("fails", opposed), _named("open", rest), self._unseen_words]
        if not shown or 2 * len(shown) <= len(self.levels):
            found.insert(0, _named("holds", shown or _largest(self.shown)) or "holds nowhere")
            return "; ".join(filter(None, found))
        return f"holds, but {'; '.join(filter(None, found))}"

    @property
    def _unseen_words(self) -> str:
        return _named("too few flights arrive", _largest(self.unseen))

    def _is_shown(self, part: Part, direction: int) -> bool:
        """Tell whether a direction is shown in a part, not adjusted."""
        return self.tests[part].p < ALPHA and self.tests[part].direction == direction

    @property
    def size(self) -> str:
        """The size in the middle cell, with its range over all cells, as the statement writes it."""
        words, seen = self.statement.size, [pairs for pairs in self.cells.values() if pairs.maps]
        if not seen:
            return ""
        sizes = [self.statement.test.size(pairs.first, pairs.second) for pairs in seen]
        if "{first}" in words:
            rates = {n: _span([100.0 * float(getattr(one, n).mean()) for one in seen]) for n in ("first", "second")}
            return words.format(**rates)
        return words.format(_span(self._in_units(sizes)))

    def _in_units(self, sizes: Iterable[float]) -> list[float]:
        """Turn sizes into the units in which the statement writes them."""
        words = self.statement.size
        turned = [one - 1.0 if "% more" in words else 1.0 - one if "% less" in words else one for one in sizes]
        return [100.0 * one for one in turned] if "%" in words else turned

    @property
    def interval(self) -> str:
        """The size over all maps, each of which counts once, with its 95 % interval."""
        words, scores = self.statement.size, scores_at(self.cells, (), self.statement.test)
        if not len(scores):
            return ""
        middle, *ends = self._in_units(self.statement.test.estimate(scores))
        low, high = sorted(ends)
        known = math.isfinite(low) and math.isfinite(high)
        among = f"{low:.3g} to {high:.3g}" if known else f"unknown from {counted(len(scores), 'map')}"
        said = f"{middle + 0.0:.3g} ({CONFIDENCE:.0%}: {among})".replace("%:", " %:")
        return f"{said} points" if "{first}" in words else words.format(said)

    @property
    def why(self) -> str:
        """How many parts show what."""
        at = sum(self._is_shown(one, 1) for one in self.levels)
        maps = {one for pairs in self.cells.values() for one in pairs.maps}
        return (
            f"shown at {at} of {len(self.levels)} levels; the opposite in {len(self.opposed)} of {len(self.tests)} "
            f"parts; {len(maps)} maps, {len(self.cells)} cells"
        )

    @property
    def row(self) -> Row:
        """The line of the page."""
        one = self.statement
        return Row(one.text, self.answer, Basis.PANEL, self.where, self.size, one.printed, self.why, self.interval)


def judged(samples: Samples, statement: Statement) -> Judged:
    """
    Test a statement in all parts of its part of the panel.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> records = [
    ...     {"map": i, "radius": radius, "k": k, "risk": float(rng.uniform(1, 2)) / k}
    ...     for i in range(20)
    ...     for radius in (0.1, 0.2)
    ...     for k in (10.0, 50.0)
    ... ]
    >>> found = judged(Samples(records), Statement("less", "risk", {"k": 50.0}, {"k": 10.0}, factors=("radius",)))
    >>> found.answer.label, found.row.size
    ('holds', 'x 0.205 (0.196 to 0.213)')
    """
    cells = pairs_of(samples, statement)
    return Judged(statement, cells, {part: _tested(cells, part, statement) for part in _parts(cells)})


def _parts(cells: Iterable[Cell]) -> list[Part]:
    """List the parts of the panel: levels, pairs of levels, and cells; a part that is a single cell stands once."""
    cells = list(cells)
    levels: dict[str, dict[Any, None]] = {}
    for name, level in (setting for cell in cells if not cell[-1][1] for setting in cell[:-1]):
        levels.setdefault(name, {})[level] = None
    free = {name: found for name, found in levels.items() if len(found) > 1}
    parts: list[Part] = [((name, level),) for name, found in free.items() for level in found]
    for a, b in combinations(free, 2):
        parts += [((a, one), (b, other)) for one, other in product(free[a], free[b])]
    varied = dict.fromkeys(cell[-1] for cell in cells if cell[-1][1])
    parts += [(setting,) for setting in varied]
    found: dict[frozenset[Cell], Part] = {}
    for part in [*parts, *cells]:
        found.setdefault(frozenset(_members(cells, part)), part)
    return list(found.values())


def _members(cells: Iterable[Cell], part: Part) -> list[Cell]:
    """Return the cells of a part; varied ones belong only to the part of their setting, and to themselves."""
    fixed = dict(part)
    return [
        cell
        for cell in cells
        if all((name, level) in cell for name, level in part) and (VARIED in fixed or not cell[-1][1])
    ]


def scores_at(cells: Mapping[Cell, Pairs], part: Part, test: Method) -> FloatArray:
    """Return what each map says in a part of the panel, shape ``(maps,)``: of ratios, logarithms; a map counts once."""
    scores: dict[int, list[float]] = {}
    for cell in _members(cells, part):
        pairs = cells[cell]
        for one, first, second in zip(pairs.maps, pairs.first, pairs.second, strict=True):
            scores.setdefault(one, []).append(test.score(float(first), float(second)))
    return np.array([test.pooled(of, number) for number, of in scores.items()], dtype=np.float64)


def _tested(cells: Mapping[Cell, Pairs], part: Part, statement: Statement) -> Sign:
    found = statement.test.tested(scores_at(cells, part, statement.test))
    # tests ask whether the first is greater, or within
    turned = statement.less and not isinstance(statement.test, Within)
    return found._replace(direction=-found.direction) if turned else found


def _largest(parts: Sequence[Part]) -> list[Part]:
    """Leave out parts that are inside of another one."""
    kept: list[Part] = []
    for part in sorted(parts, key=len):
        if not any(set(other) <= set(part) for other in kept):
            kept.append(part)
    return kept


def _named(verb: str, parts: Sequence[Part]) -> str:
    if not parts:
        return ""
    more = f" and {len(parts) - MOST_NAMED} more" if len(parts) > MOST_NAMED else ""
    return f"{verb} {'; '.join(f'at {part_name(one)}' for one in parts[:MOST_NAMED])}{more}"


#: How levels of factors are written.
_WORDS = {
    "threats": "{} threats",
    "spread": "{} spreads",
    "goal": "goal {}",
    "radius": "OR {:g}",
    "k": "K = {:g}",
    "high": "K = {:g} against less",
    "n": "N = {}",
    "obstacle": "obstacle spread {:g}",
    "ahead": "{:g} spreads ahead",
    "obstacle_spread": "obstacle spread {:g}",
    "safe_distance": "SD {:g}",
    "delay": "{} ticks late",
}


def part_name(part: Part) -> str:
    """
    Write a part of the panel in a few words.

    Examples
    --------
    >>> part_name((("radius", 0.1), ("threats", 30), ("varied", "")))
    'OR 0.1, 30 threats'
    """
    words = [_WORDS.get(name, "{}").format(level) for name, level in part if level != ""]
    return ", ".join(words) or "all"


def _span(values: Sequence[float]) -> str:
    """Write the middle one of several values, and between which all of them lie; one, where they are written alike."""
    # what rounding leaves of nothing is nothing
    ends = (round(end, 9) + 0.0 for end in (min(values), float(np.median(values)), max(values)))
    low, middle, high = (f"{end:.3g}" for end in ends)
    return low if low == high else f"{middle} ({low} to {high})"


def panel_table(title: str, found: Iterable[Judged]) -> Table:
    """Tabulate what the levels of the panel say of statements, one row each, with 95 % intervals."""
    rows = [(one.statement.text, *_level_entries(one, part)) for one in found for part in one.levels]
    return Table(title, ("statement", "at", "maps", "size", "from", "to", "shown", "p"), rows)


def _level_entries(one: Judged, part: Part) -> tuple[str, int, float | None, float | None, float | None, str, float]:
    test, scores = one.tests[part], scores_at(one.cells, part, one.statement.test)
    size = one.statement.test.estimate(scores) if len(scores) else (None, None, None)
    found = test.direction if test.p < ALPHA else 0
    words = {1: "yes", 0: "no", -1: "the opposite"}[found]
    return part_name(part), test.n, *size, words, test.p
