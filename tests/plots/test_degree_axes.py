"""Axes in degrees of maps in metres."""

import dataclasses

import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.comparisons.report.maps import map_document
from cgla_graph.model.earth import LocalProjection
from cgla_graph.plots.degrees import compass, degree_ticks
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


@pytest.mark.parametrize("latitude", [90.0, 84.0, -88.0])
def test_a_side_that_passes_a_pole_has_a_label_wherever_a_parallel_meets_it(latitude: float) -> None:
    """Latitude rises and falls along the side: each label is where its parallel is, and most are there twice."""
    projection = LocalProjection(30.0, latitude)
    box = (-2e6, -2e6, 2e6, 2e6)
    x, y = degree_ticks(projection, box)
    for which, ticks in enumerate((x, y)):
        assert [at for at, _ in ticks] == sorted(at for at, _ in ticks)
        for at, label in ticks:
            number, _, letter = label.partition("° ")
            degrees = float(number.rstrip("°")) * (-1.0 if letter in {"W", "S"} else 1.0)
            there = float(projection.inverse((at, box[1]) if which == 0 else (box[0], at))[which])
            assert (there - degrees + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.05)
    texts = [text for _, text in y]
    assert len(set(texts)) < len(texts)


def test_a_compass_measures_as_geodesics_do() -> None:
    geod = pyproj.Geod(ellps="WGS84")
    for longitude, latitude, side in ((24.0, 60.0, 1e5), (-179.9, -45.0, 1e4), (10.0, 0.0, 3e6), (7.0, 78.0, 5e5)):
        projection, box = LocalProjection(longitude, latitude), (-0.2 * side, -side, 1.8 * side, side)
        found = compass(projection, box)
        middle, span = (0.8 * side, 0.0), 0.01 * side
        left, here, right, ahead = projection.inverse(
            [(0.8 * side - span, 0.0), middle, (0.8 * side + span, 0.0), (0.8 * side, span)]
        ).tolist()
        assert found.metres == pytest.approx(geod.inv(*left, *right)[2] / (2.0 * span), rel=1e-4)
        assert found.north is not None
        assert geod.inv(*here, *ahead)[0] == pytest.approx(-found.north, abs=0.2)
    assert compass(LocalProjection(0.0, 90.0), (-1e5, -1e5, 1e5, 1e5)).north is None
