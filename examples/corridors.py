"""A graph of one's own: corridors between places, weighed by length and risk, and all costs to one of them."""

import networkx as nx

import cgla_graph as cg

PLACES = {
    "harbour": (0.05, 0.10),
    "island": (0.35, 0.05),
    "town": (0.50, 0.45),
    "forest": (0.20, 0.60),
    "lake": (0.55, 0.85),
    "airfield": (0.95, 0.90),
}
CORRIDORS = [
    ("harbour", "island"),
    ("harbour", "forest"),
    ("harbour", "town"),
    ("island", "town"),
    ("forest", "lake"),
    ("town", "lake"),
    ("town", "airfield"),
    ("lake", "airfield"),
]

corridors = nx.Graph(CORRIDORS)
nx.set_node_attributes(corridors, PLACES, "pos")
people = cg.RiskField([cg.Threat(x=0.5, y=0.45, spread=0.1)])

for k in (0, 2, 10):
    graph = cg.GeometricGraph.from_networkx(corridors, weight=None, pos="pos", field=people, k=k)
    answer = cg.solve(cg.GraphProblem(graph, "harbour", "airfield"), solver="cgla")
    print(f"k = {k:2}: cost {answer.cost:.3f} by {' - '.join(answer.nodes)}")

matrix = cg.cost_matrix(graph, target="airfield")
print("to the airfield, with k = 10:", {name: round(matrix.value(name), 3) for name in PLACES})
