"""Axes in degrees of maps in metres."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.comparisons.report.maps import map_document
from cgla_graph.model.earth import LocalProjection
from cgla_graph.plots.degrees import degree_ticks
from cgla_graph.scenarios.scenario import load_scenario


@few
@given(longitude=st.floats(-180, 180), latitude=st.floats(-75, 75), side=st.floats(50.0, 300_000.0))
def test_labels_are_where_their_degrees_are(longitude: float, latitude: float, side: float) -> None:
    """Read the labels again and compare with the projection, also across the antimeridian."""
    projection = LocalProjection(longitude, latitude)
    box = (-side, -0.5 * side, side, side)
    for which, ticks in enumerate(degree_ticks(projection, box)):
        assert 2 <= len(ticks) <= 8
        for at, label in ticks:
            number, _, letter = label.partition("° ")
            degrees = float(number.rstrip("°")) * (-1.0 if letter in {"W", "S"} else 1.0)
            corner = (at, box[1]) if which == 0 else (box[0], at)
            assert box[which] <= at <= box[which + 2]
            there = float(projection.inverse(corner)[which])
            assert (there - degrees + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=2e-4 * side / 100_000.0 + 1e-6)


def test_a_report_has_axes_in_degrees_only_where_the_map_has() -> None:
    flat = load_scenario("one-threat")
    assert map_document(flat)["axes"] is None
    middle = LocalProjection(25.0, 60.0)
    there = dataclasses.replace(flat, problem=dataclasses.replace(flat.problem, projection=middle))
    (x, words), (_, others) = map_document(there)["axes"]
    assert len(x) == len(words)
    assert all(word.endswith(" E") for word in words)
    assert all(word.endswith(" N") for word in others)
