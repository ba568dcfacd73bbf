"""Eq. 5 along one segment: risk where two threats overlap, as three Gaussians; and what sums of samples miss."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, RED, panels

import cgla_graph as cg

threats = [cg.Threat(0.4, 0.45, 0.08, peak=0.9), cg.Threat(0.58, 0.52, 0.05, peak=0.7)]
field = cg.RiskField(threats)
start, end = np.array([0.1, 0.5]), np.array([0.9, 0.5])
along = np.linspace(0.0, 1.0, 500)
places = start + along[:, None] * (end - start)
one, other = (cg.RiskField([threat]).density(places) for threat in threats)

left, right = panels(["risk along a segment", "error of a sum over n positions"], width=3.8, height=3.0)
left.fill_between(along, field.density(places), color="0.9")
left.plot(along, field.density(places), color=GREY, linewidth=2.2, label="F = f₁ + f₂ - f₁f₂")
left.plot(along, one, color=BLUE, linewidth=1.2, label="f₁")
left.plot(along, other, color=ORANGE, linewidth=1.2, label="f₂")
left.plot(along, -one * other, color=RED, linewidth=1.2, label="-f₁f₂: a Gaussian as well")
left.axhline(0.0, color="0.6", linewidth=0.6)
left.set(xlabel="part of the segment", ylim=(-0.15, 1.25))
left.legend(frameon=False, fontsize=8, ncols=2, loc="upper left")

narrow = cg.RiskField([cg.Threat(0.5, 0.52, 0.008)])
counts = np.unique(np.geomspace(3, 1000, 60).astype(int))
for what, colour, name in ((field, BLUE, "the two threats"), (narrow, RED, "one of spread 0.008")):
    exact = what.line_integral(start, end)
    sums = [
        what.density(start + ((np.arange(n) + 0.5) / n)[:, None] * (end - start)).mean() * np.linalg.norm(end - start)
        for n in counts
    ]
    right.loglog(counts, np.maximum(np.abs(np.array(sums) / exact - 1.0), 1e-16), ".-", color=colour, label=name)
right.axvline(50, color=GREY, linewidth=0.8, linestyle=":")
right.text(46, 1e-15, "50 positions", fontsize=8, color=GREY, ha="right")
right.set(xlabel="n", ylim=(1e-16, 10))
right.legend(frameon=False, fontsize=8)
