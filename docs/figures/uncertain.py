"""Paths under uncertain risk, for several parts of the worst cases."""

import dataclasses

from drawing import BLUE, GREEN, ORANGE, RED, draw_map, draw_path, panels

import cgla_graph as cg

believed = cg.RiskField([cg.Threat(0.35, 0.45, 0.08), cg.Threat(0.62, 0.6, 0.1, 0.8)])
known = cg.Problem((0.05, 0.5), (0.95, 0.5), believed, k=8.0)
problem = dataclasses.replace(known, field=cg.sample_field(known, 30, place=0.06, spread=0.2, seed=1))
left, right = panels(["paths by alpha", "their costs in the scenarios"], width=3.6, height=3.2)
draw_map(left, problem)
for alpha, colour in ((0.0, BLUE), (0.5, GREEN), (0.9, ORANGE), (1.0, RED)):
    plan = cg.solve(problem, objective="cvar", alpha=alpha)
    name = {0.0: "0: expected", 1.0: "1: worst"}.get(alpha, f"{alpha:g}")
    draw_path(left, plan.path, colour, label=name)
    right.plot(sorted(plan.costs), colour, marker=".", markersize=3, linewidth=1.0)  # type: ignore[attr-defined]
left.legend(title="alpha", fontsize=7, title_fontsize=7, frameon=False, loc="upper left")
right.set(xlabel="scenarios, cheapest first", ylabel="cost")
