"""The projection under its old name; it is `cgla_graph.model.projection` now."""

from cgla_graph.model.projection import (
    LocalProjection,
    geodesic_length,
    places_around,
    project_area,
    projected_bounds,
    wrapped,
)

__all__ = ["LocalProjection", "geodesic_length", "places_around", "project_area", "projected_bounds", "wrapped"]
