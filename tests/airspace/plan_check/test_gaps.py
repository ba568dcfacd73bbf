"""Distances of legs from the geodesics between their ends."""

import numpy as np
import pyproj
import pytest
import shapely

import cgla_graph as cg
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.zone import Layer, Zone


def test_gaps_are_the_distances_of_legs_from_geodesics() -> None:
    zone = Zone("A", "", "PROHIBITED", (Layer(shapely.box(20.0, 66.0, 20.1, 66.1)),))
    places = [(20.0, 60.0), (30.0, 60.0), (25.0, 62.0)]
    found = cg.check(cg.FlightPlan.along(places, altitude=80), zones=Zones((zone,)), tolerance=None)
    projection = found.on.problem.projection
    assert projection is not None
    for leg, gap in enumerate(found.gaps.tolist()):
        ends = found.on.route[[leg, leg + 1]]
        inner = pyproj.Geod(ellps="WGS84").npts(*projection.inverse(ends).ravel(), 99)
        away = shapely.distance(shapely.LineString(ends), shapely.points(projection.forward(np.array(inner))))
        assert away.max() > 10.0
        assert gap == pytest.approx(away.max(), rel=0.05, abs=0.1)
