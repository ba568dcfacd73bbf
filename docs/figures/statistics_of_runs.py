"""Why means over survivors mislead, and how sure an interval of a median is for a few runs."""

import numpy as np
import scipy
from drawing import BLUE, GREY, ORANGE, RED, panels

from cgla_graph.comparisons.statistics.intervals import FEWEST_RUNS, estimate, interval_ranks

# made up: one solver gives up where it is hard, the other finds a path everywhere, at a price
rng = np.random.default_rng(4)
difficulty = np.sort(rng.gamma(2.0, 0.25, 25))
quits = np.where(difficulty > np.quantile(difficulty, 0.6), np.inf, 1.0 + difficulty)
stays = 1.0 + 0.95 * difficulty

left, right = panels(["25 maps, the hardest on the right", "an interval of the median"], width=3.8, height=3.2)
for costs, colour, name in ((quits, ORANGE, "gives up"), (stays, BLUE, "goes on")):
    found = np.isfinite(costs)
    left.plot(np.flatnonzero(found), costs[found], "o", color=colour, markersize=4, label=name)
    left.axhline(costs[found].mean(), color=colour, linewidth=1, linestyle="--")
    left.text(25.4, costs[found].mean(), "mean of\nsurvivors", color=colour, fontsize=7, va="center")
    left.axhline(estimate(costs.tolist()).median, color=colour, linewidth=1.4, alpha=0.6)
lost = np.flatnonzero(np.isinf(quits))
left.plot(lost, np.full(len(lost), 2.75), "x", color=RED, label="no path: infinite")
left.set(xlim=(-1, 30), ylabel="cost", xticks=[])
left.legend(frameon=False, fontsize=8, loc="upper left")

sizes = np.arange(1, 41)
for n in sizes:
    low, high = interval_ranks(int(n)) or (1, int(n))
    covered = 1.0 - 2.0 * scipy.stats.binom.cdf(low - 1, n, 0.5)
    right.plot(n, covered, "o", color=BLUE if n >= FEWEST_RUNS else GREY, markersize=3.5)
right.axhline(0.95, color=RED, linewidth=0.8)
right.text(40, 0.945, "95 %", color=RED, fontsize=8, ha="right", va="top")
right.text(5.5, 0.3, "fewer than 6 runs:\nno such interval", color=GREY, fontsize=8)
right.set(xlabel="runs", ylabel="chance to hold the median", ylim=(0, 1.05))
