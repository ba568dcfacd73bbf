"""The size of the lattice (C46): whether paths on lattices of three sizes are nearly the same."""

import math
from collections.abc import Sequence

import numpy as np

from cgla_graph.comparisons.claims.claim import Entry, Finding, Table, claim
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.resolution import SAME_WITHIN
from cgla_graph.comparisons.claims.rule import judged, panel_table, part_name
from cgla_graph.comparisons.claims.statement import Share, Statement

#: The share of maps to be exceeded, set before the first sample. The paper, which shows one map, names none.
OFTEN = 0.95
#: What else could count as nearly the same, map units.
BARS = (0.05, 0.1, SAME_WITHIN, 0.2, 0.3)
#: With all known over K, in flight over the detection radius.
_MODES: tuple[tuple[str, str, str], ...] = (("all known", "known", "k"), ("in flight", "flown", "radius"))


@claim(
    46,
    "Section 5.2.3, Fig. 11",
    "The paths at N = 15, 20 and 25 are nearly the same (K = 40).",
    "All kinds of maps, planned with all known at the paper's K = 40 and the panel's, and flown at K = 40 and each "
    "radius: the paper shows one map and names no radius. Varied in flight: K, integral, replanning and start.",
    experiments=("resolution",),
    figures=("Fig. 11",),
)
def _check_c46(evidence: Evidence) -> Finding:
    samples = evidence.samples["resolution"]
    found = [
        judged(
            samples,
            Statement(
                f"nearly the same on > {OFTEN:.0%} of maps, {words}",
                "same",
                {"mode": mode},
                OFTEN,
                less=False,
                test=Share(OFTEN),
                factors=("threats", "spread", "goal", factor),
                size="on {} % of maps",
                printed="on its one map",
            ),
        )
        for words, mode, factor in _MODES
    ]
    return Finding(
        tuple(one.row for one in found),
        notes=(
            (
                f"Nearly the same: no two of the three paths are more than {SAME_WITHIN:.3g} apart, two cells of the "
                f"coarsest lattice (discrete Fréchet distance), on more than {OFTEN:.0%} of maps. Both bars are ours, "
                "and were set before the first sample. If only some of the three flights arrive, they are not the same."
            ),
            "Start and goal are nodes of every lattice; (0.1, 0.1) is a point of none of the three.",
        ),
        tables=(panel_table("Share of maps on which paths are nearly the same", found), _bars_table(samples)),
    )


def _bars_table(samples: Samples) -> Table:
    """Tabulate on how many maps paths are within several distances, so that another bar can be read off."""
    rows: list[list[Entry]] = []
    for words, mode, factor in _MODES:
        chosen = [record for record in samples.where(mode=mode) if not record.get("varied")]
        for level in sorted({record[factor] for record in chosen}):
            of = [record for record in chosen if record[factor] == level]
            rows.append([words, part_name(((factor, level),)), *_so_near(of)])
    heads = ("paths", "at", "maps", *(f"within {bar:.3g}" for bar in BARS), "greatest cost over least, median")
    return Table(
        "Share of maps on which the paths at N = 15, 20 and 25 are so near to each other",
        heads,
        rows,
        "all kinds of maps together",
    )


def _so_near(records: Sequence[Record]) -> list[Entry]:
    """Return on how many maps any flight arrives, the shares within each of `BARS`, and the median ratio of costs."""
    known = [record for record in records if record["same"] is not None]
    distances = np.array([math.inf if one["distance"] is None else one["distance"] for one in known])
    ratios = [one["cost_ratio"] for one in known if one["cost_ratio"] is not None]
    shares = [float((distances <= bar).mean()) if known else math.nan for bar in BARS]
    return [len(known), *shares, float(np.median(ratios)) if ratios else math.nan]
