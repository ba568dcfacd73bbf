"""A graph of corridors, weighed by risk: three values of k take three ways."""

import networkx as nx
import numpy as np
from drawing import BLUE, draw_map, draw_path, panels

import cgla_graph as cg

rng = np.random.default_rng(3)
places = rng.random((60, 2))
corridors = nx.random_geometric_graph(60, 0.24, pos=dict(enumerate(places.tolist())))
field = cg.RiskField([cg.Threat(0.45, 0.5, 0.12), cg.Threat(0.7, 0.75, 0.06)])
first, last = (int(np.argmin(np.linalg.norm(places - corner, axis=1))) for corner in ((0, 0), (1, 1)))
weights = (0.0, 2.0, 20.0)
for axes, k in zip(panels([f"k = {k:g}" for k in weights], width=2.5, height=2.8), weights, strict=True):
    graph = cg.GeometricGraph.from_networkx(corridors, weight=None, pos="pos", field=field, k=k)
    answer = cg.solve(cg.GraphProblem(graph, first, last), "cgla")
    draw_map(axes, cg.Problem(tuple(places[first]), tuple(places[last]), field, k, bounds=(0, 0, 1, 1)))
    for one, other in corridors.edges:
        axes.plot(*places[[one, other]].T, color="0.6", linewidth=0.5, zorder=2)
    draw_path(axes, places[list(answer.nodes)], BLUE, linewidth=2.2)
    axes.set_xlabel(f"cost {answer.cost:.2f}", fontsize=8.5)
