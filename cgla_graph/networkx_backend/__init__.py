"""A backend of networkx: its shortest-path functions over a `GeometricGraph` or a converted networkx graph."""
