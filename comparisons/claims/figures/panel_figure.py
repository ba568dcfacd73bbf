"""Fig. A1, which is ours: the two comparisons that are asked for first, at every level of the panel."""

import math
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from cgla_graph.comparisons.claims.artefact import Content, artefact
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.figures.figure_page import WIDE, finish, page, picture
from cgla_graph.comparisons.claims.paper.bcv_claims import against_bcv
from cgla_graph.comparisons.claims.paper.direction_claims import DIRECTIONS
from cgla_graph.comparisons.claims.rule import Judged, judged, part_name, scores_at
from cgla_graph.comparisons.claims.statement import Shift, Statement
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.plots.scene import colour_of, line_key

#: What is drawn of each comparison.
MEASURES = ("length", "cost", "risk")
#: By title of the panel, the statements that it shows.
PANELS: Mapping[str, Sequence[Statement]] = {
    "eight directions over CGLA, flown": [one for one in DIRECTIONS if one.where["mode"] == "flown"],
    "CGLA over BCV-style (length only), K = 10": [
        one for one in against_bcv("length only") if isinstance(one.test, Shift)
    ],
}


@artefact("Fig. A1", "eight directions and BCV-style at every level of the panel", experiments=("single-uav",))
def _fig_a1(evidence: Evidence) -> Content:
    samples = evidence.samples["single-uav"]
    with page() as figure:
        rows = []
        for title, statements in PANELS.items():
            axes = figure.add_subplot()
            ordered = sorted(statements, key=lambda one: MEASURES.index(one.measure))
            names = _draw_levels(axes, samples, ordered)
            axes.set_title(title, fontsize=9.0, loc="left")
            rows.append((axes, (WIDE, 0.16 * names + 0.3)))
        keys = [(line_key(color=colour_of(i), marker="o"), name) for i, name in enumerate(MEASURES)]
        heading = ("Fig. A1", "Ratios at every level of the panel, maps pooled over the other factors")
        finish(figure, heading, [rows], keys, columns=3)
    return picture(
        figure,
        "Hodges-Lehmann estimates of ratios, with 95 % intervals; a map counts once, with the mean over its cells. "
        "Right of 1 the first has more. Panel, planners in the style of others, and their constants are ours.",
    )


def _draw_levels(axes: Axes, samples: Samples, statements: Sequence[Statement]) -> int:
    """Draw the ratio of each statement at each level of the panel; return how many levels there are."""
    found = [judged(samples, one) for one in statements]
    levels = found[0].levels
    for number, one in enumerate(found):
        for row, part in enumerate(levels):
            ratio, low, high = level_ratio(one, part)
            height = row + 0.22 * (1 - number)
            axes.plot([low, high], [height, height], color=colour_of(number), linewidth=1.4)
            axes.plot(ratio, height, "o", color=colour_of(number), markersize=3.0)
    axes.axvline(1.0, color="0.6", linewidth=0.9)
    axes.set(xlabel="ratio", yticks=range(len(levels)), ylim=(len(levels) - 0.4, -0.6))
    axes.set_yticklabels([part_name(part) for part in levels], fontsize=7.0)
    axes.set_axisbelow(True)
    axes.grid(color="0.92", linewidth=0.5)
    return len(levels)


def level_ratio(one: Judged, part: tuple[tuple[str, object], ...]) -> tuple[float, float, float]:
    """Return the ratio at a level of the panel, with its 95 % interval; a map counts once, with its mean logarithm."""
    scores = scores_at(one.cells, part, one.statement.test)
    if not len(scores):
        return math.nan, math.nan, math.nan
    found = hodges_lehmann(scores.tolist())
    return math.exp(found.median), math.exp(found.low), math.exp(found.high)
