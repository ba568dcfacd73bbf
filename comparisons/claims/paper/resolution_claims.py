"""The size of the lattice (C46): whether paths on lattices of three sizes are nearly the same."""

from functools import partial

from cgla_graph.comparisons.claims.claim import Finding, claim, flown_at
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.resolution import SAME_WITHIN
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Share, Statement

#: The share of maps to be exceeded, set before the first sample. The paper, which shows one map, names none.
OFTEN = 0.95
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
    settings=flown_at(40.0),
)
def _check_c46(evidence: Evidence) -> Finding:
    often = partial(Statement, second=OFTEN, less=False, test=Share(OFTEN), size="on {} % of maps", printed="one map")
    found = [
        judged(
            evidence.samples["resolution"],
            often(
                f"nearly the same on > {OFTEN:.0%} of maps, {words}",
                "same",
                first={"mode": mode},
                # flights are at the paper's K, unless a user gives others
                factors=("threats", "spread", "goal", *dict.fromkeys((factor, *evidence.panel.given("k")))),
            ),
        )
        for words, mode, factor in _MODES
    ]
    return Finding(
        tuple(one.row for one in found),
        notes=(
            f"Nearly the same: no two of three paths are over {SAME_WITHIN:.3g} apart, two coarse cells (Fréchet).",
            "Both bars are ours, set before the first sample. If only some flights arrive, they are not the same.",
            "Start and goal are nodes of every lattice; (0.1, 0.1) is a point of none of the three.",
        ),
        tables=(panel_table("Share of maps on which paths are nearly the same", found),),
    )
