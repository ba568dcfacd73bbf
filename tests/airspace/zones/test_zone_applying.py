"""States of zones at an altitude and a time."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual
from zone_files import NIGHTS, data_of, ed269, ed318, volume

from cgla_graph.airspace.zones.applying import BELOW, NOT_COMPARED, Verdict, Zones
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.airspace.zones.heights import Altitude
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.airspace.zones.zone import TREATMENTS, Layer, Limit, Zone
from cgla_graph.errors import FileFormatError

BOX = shapely.box(6.0, 49.0, 6.2, 49.2)
#: 300 m in the west of longitude 6.1, 400 m in the east.
GROUND = Ground(np.repeat([[300.0] * 21 + [400.0] * 19], 40, axis=0), (5.9, 48.9, 6.3, 49.3))


def verdict(zone: Zone, **how: object) -> Verdict:
    (one,) = Zones((zone,)).apply(**how).verdicts  # type: ignore[arg-type]
    return one


def limited(lower: tuple[float, str], upper: tuple[float, str], **more: object) -> Zone:
    layer = Layer(BOX, Limit(*lower), Limit(*upper))  # type: ignore[arg-type]
    return Zone("A", "", "PROHIBITED", (layer,), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("lower", "upper", "altitude", "state", "compared"),
    [
        ((0, "AGL"), (120, "AGL"), 100, "closed", True),
        ((0, "AGL"), (120, "AGL"), 120, "closed", True),
        ((0, "AGL"), (120, "AGL"), 121, "open", True),
        ((50, "AGL"), (120, "AGL"), 49, "open", True),
        ((50, "AGL"), (120, "AGL"), None, "closed", True),
        ((0, "AMSL"), (450, "AMSL"), "460 AMSL", "open", True),
        ((0, "AGL"), (99, "AGL"), "460 AMSL", "closed", False),
        ((0, "AGL"), (450, "AMSL"), 100, "closed", False),
        ((0, "AGL"), (450, "AMSL"), "100 home", "closed", False),
        ((0, "AGL"), (float("inf"), "AMSL"), 100, "closed", True),
        # the ground does not matter where the other limit decides
        ((200, "AGL"), (450, "AMSL"), 100, "open", True),
        ((0, "WGS84"), (450, "AMSL"), "460 AMSL", "open", True),
        # the geoid is known to 100 m
        ((0, "AGL"), (450, "WGS84"), "600 AMSL", "open", True),
        ((0, "AGL"), (450, "WGS84"), "460 AMSL", "closed", True),
    ],
)
def test_heights(
    lower: tuple[float, str], upper: tuple[float, str], altitude: object, state: str, compared: bool
) -> None:
    found = verdict(limited(lower, upper), altitude=altitude)
    assert found.state == state
    assert (found.remark == NOT_COMPARED) is not compared


@pytest.mark.parametrize(
    ("lower", "upper", "altitude", "state"),
    [
        ((0, "AGL"), (450, "AMSL"), 100, "closed"),  # at 400 m AMSL in the west
        ((0, "AGL"), (450, "AMSL"), 151, "open"),
        ((0, "AGL"), (100, "AGL"), "450 AMSL", "closed"),  # at 50 m AGL in the east
        ((0, "AGL"), (100, "AGL"), "501 AMSL", "open"),
        ((520, "AMSL"), (900, "AMSL"), 119, "open"),
        ((520, "AMSL"), (900, "AMSL"), 121, "closed"),
    ],
)
def test_the_ground_resolves_heights(
    lower: tuple[float, str], upper: tuple[float, str], altitude: object, state: str
) -> None:
    zone = limited(lower, upper)
    assert verdict(zone, altitude=altitude, ground=GROUND).state == state
    assert verdict(zone, altitude=altitude, ground=GROUND).remark in {"", BELOW}
    # elevations outside the raster and in cells without data are unknown
    for unknown in (Ground(GROUND.values, (6.05, 48.9, 6.3, 49.3)), Ground(np.full((40, 40), np.nan), GROUND.bounds)):
        assert verdict(zone, altitude=altitude, ground=unknown).remark == NOT_COMPARED


@usual
@given(
    heights=st.lists(st.integers(-100, 1000), min_size=3, max_size=3),
    above=st.lists(st.sampled_from(["AGL", "AMSL"]), min_size=3, max_size=3),
    x=st.floats(6.0, 6.2),
    y=st.floats(49.0, 49.2),
)
def test_a_flight_that_is_in_a_layer_somewhere_is_never_open(
    heights: list[int], above: list[str], x: float, y: float
) -> None:
    """The zone is closed for a flight inside it at any place, with that place's elevation, with a raster or without."""
    lower, upper = sorted(heights[:2])
    zone = limited((lower, above[0]), (upper, above[1]))
    row, column = int((49.3 - y) * 100), int((x - 5.9) * 100)
    here = GROUND.values[min(row, 39), min(column, 39)]
    flight, low, high = (
        value + here * (kind == "AGL")
        for value, kind in zip((heights[2], lower, upper), (above[2], *above[:2]), strict=True)
    )
    if low <= flight <= high and flight >= here:
        for ground in (None, GROUND):
            assert verdict(zone, altitude=f"{heights[2]} {above[2]}", ground=ground).state == "closed"


def test_several_layers_close_what_they_cover_alone() -> None:
    low = volume(horizontalProjection={"type": "Circle", "center": [6.1, 49.1], "radius": 1000})
    high = volume(lowerLimit=120, upperLimit=500)
    (zone,) = zones_of(data_of(ed269(low, high)), "mine").zones
    areas = {altitude: verdict(zone, altitude=altitude).area for altitude in (60, 120, 200, 501, None)}
    assert areas[501] is None
    assert areas[60].area < areas[200].area < areas[120].area == areas[None].area  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("period", "inside", "outside"),
    [
        (
            {"startDateTime": "2026-08-01T06:00:00+02:00", "endDateTime": "2026-08-01T18:00:00Z"},
            ["2026-08-01T04:00Z", "2026-08-01T20:00+02:00", "2026-07-31T24:00-06:00"],
            ["2026-08-01T03:59:59Z", "2026-08-01T18:00:01Z"],
        ),
        (
            {"schedule": [NIGHTS]},
            ["2026-08-07T22:00Z", "2026-08-08T05:59Z", "2026-08-08T06:00:59Z"],
            ["2026-08-07T21:59Z", "2026-08-08T06:01Z", "2026-08-08T22:00Z"],
        ),
        (
            {"schedule": [{"day": ["MON", "ANY"], "startTime": "10:00:00+02:00", "endTime": "12:00:00+02:00"}]},
            ["2026-08-02T08:00Z", "2026-08-02T12:00+02:00"],
            ["2026-08-02T07:59Z", "2026-08-02T12:01+02:00"],
        ),
        # a time without a UTC offset may have any
        (
            {"schedule": [{"day": "SUN", "startTime": "10:00", "endTime": "12:00"}]},
            ["2026-08-01T20:00Z", "2026-08-03T00:00Z"],
            ["2026-08-01T19:59Z", "2026-08-03T00:02Z"],
        ),
        (
            {"schedule": [{"day": ["SUN"], "startEvent": "SS", "endTime": "23:00Z"}]},
            # the sun sets at 19:13
            ["2026-08-02T19:13Z", "2026-08-02T23:00:59Z"],
            ["2026-08-02T18:55Z", "2026-08-02T23:01:01Z", "2026-08-02T01:00Z", "2026-08-01T22:00Z"],
        ),
        (
            {"schedule": [{"day": ["SUN"], "startEvent": "SS", "endTime": "06:00+02:00"}]},
            ["2026-08-02T23:00Z", "2026-08-03T04:00Z"],
            ["2026-08-03T04:01:01Z", "2026-08-03T20:00Z"],
        ),
        (
            {"schedule": [{"day": ["SAT"], "startTime": "01:00Z", "endEvent": "SR"}]},
            ["2026-08-01T01:00Z", "2026-08-01T04:08Z"],
            ["2026-08-01T00:59Z", "2026-08-01T04:30Z", "2026-08-02T03:00Z"],
        ),
        # a time and an event for the start contradict each other: all day, and into the next
        (
            {"schedule": [{"day": ["SUN"], "startTime": "10:00Z", "startEvent": "SR", "endEvent": "SS"}]},
            ["2026-08-02T00:00Z", "2026-08-03T10:00Z"],
            ["2026-07-31T00:00Z", "2026-08-05T00:00Z"],
        ),
        (
            {"schedule": [{"day": ["SUN"], "startTime": "00:00Z", "endTime": "24:00Z"}]},
            ["2026-08-02T23:59:59Z"],
            ["2026-08-01T23:59Z", "2026-08-03T00:02Z"],
        ),
        (
            {"startDateTime": "2026-08-03T00:00Z", "schedule": [{"day": ["SUN"]}]},
            ["2026-08-09T12:00Z"],
            ["2026-08-02T12:00Z", "2026-08-12T12:00Z"],
        ),
    ],
)
def test_times(period: dict[str, object], inside: list[str], outside: list[str]) -> None:
    """Both standards write periods alike."""
    for document in (ed269(applicability=[{"permanent": "NO", **period}]), ed318(limitedApplicability=[period])):
        (zone,) = zones_of(data_of(document), "mine").zones
        assert {verdict(zone, at=at).state for at in inside} == {"closed"}
        assert {verdict(zone, at=at).reason for at in outside} == {"not at this time"}
        assert verdict(zone).state == "closed"


@usual
@given(
    start=st.integers(0, 1439),
    length=st.integers(1, 1440),
    day=st.integers(0, 6),
    ahead=st.integers(-12, 14),
    after=st.integers(0, 10_079),
)
def test_schedules_are_those_of_the_clock(start: int, length: int, day: int, ahead: int, after: int) -> None:
    """Compare with counted minutes of a week."""
    days = ("MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN")
    clock = [f"{minute // 60 % 24:02}:{minute % 60:02}{ahead:+03}:00" for minute in (start, start + length)]
    period = {"schedule": [{"day": [days[day]], "startTime": clock[0], "endTime": clock[1]}]}
    (zone,) = zones_of(data_of(ed318(limitedApplicability=[period])), "mine").zones
    monday = datetime(2026, 8, 3, tzinfo=UTC) - timedelta(hours=ahead)
    # (an end counts to the end of its minute)
    expected = (after - (day * 1440 + start)) % 10_080 <= length
    assert (verdict(zone, at=monday + timedelta(minutes=after)).state == "closed") is expected


def test_kinds_are_closed_or_open() -> None:
    layer = (Layer(BOX),)
    zones = Zones(tuple(Zone(kind, "", kind, layer) for kind in TREATMENTS))
    assert zones.apply().account().summary() == (
        "6 zones: 5 closed (1 PROHIBITED, 1 REQ_AUTHORISATION, 1 CONDITIONAL, 1 USPACE, 1 UNCLASSIFIED), "
        "1 open (1 NO_RESTRICTION)"
    )
    treat = {"REQ_AUTHORIZATION": "open", "no_restriction": "closed"}
    states = {one.record().kind: one.state for one in zones.apply(treat=treat).verdicts}
    assert [states["REQ_AUTHORISATION"], states["NO_RESTRICTION"], states["PROHIBITED"]] == ["open", "closed", "closed"]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"altitude": "high"}, "altitude is 'high'"),
        ({"altitude": True}, "altitude is true"),
        ({"altitude": float("nan")}, "altitude is"),
        ({"altitude": "100 FL"}, "altitude is '100 FL'"),
        ({"altitude": -5}, "altitude is -5 m above ground, below the ground; give at least 0 m"),
        ({"altitude": "-0.5 HOME"}, "altitude is -0.5 m above home"),
        ({"altitude": "-501 AMSL"}, "altitude is -501 m above the sea, below all land; give at least -500 m"),
        ({"at": "2026-08-01T12:00"}, "with its zone"),
        ({"at": datetime(2026, 8, 1)}, "with its zone"),  # noqa: DTZ001 - that is the fault
        ({"at": "noon"}, "it is 'noon'"),
        ({"treat": {"REQ": "open"}}, "treat has 'REQ'"),
        ({"treat": {"CONDITIONAL": "maybe"}}, "treat.CONDITIONAL is 'maybe'"),
    ],
)
def test_what_cannot_be_applied(how: dict[str, object], said: str) -> None:
    with pytest.raises(FileFormatError, match=said):
        Zones(()).apply(**how)  # type: ignore[arg-type]


def test_altitudes_are_read() -> None:
    assert Altitude.of("450m amsl") == Altitude(450.0, "AMSL")
    assert Altitude.of(Altitude(1.0)) == Altitude.of(1) == Altitude.of("1.0 AGL")
    # the shores of the Dead Sea
    assert str(Altitude.of("-430 AMSL")) == "-430 m AMSL"
    for wrong in ((-1.0, "AGL"), (float("nan"), "AGL"), (2e5, "AMSL"), (1.0, "FL")):
        with pytest.raises(FileFormatError, match="altitude"):
            Altitude(*wrong)  # type: ignore[arg-type]


def test_a_file_that_is_not_valid_then_says_so() -> None:
    zones = zones_of(data_of(ed318()), "mine")
    assert zones.apply(at="2025-12-31T00:00Z").account().notes() == ["mine is valid from 2026-01-01 00:00 UTC only"]
    assert zones.apply(at="2026-12-31T00:00Z").account().notes() == zones.apply().account().notes() == []


def test_elevations_come_from_rasters(tmp_path: Path) -> None:
    """Elevations of a GeoTIFF may be below the sea."""
    rasterio = pytest.importorskip("rasterio")
    from rasterio.transform import Affine  # noqa: PLC0415 - needs rasterio

    path = tmp_path / "ground.tif"
    values = np.array([[-4.0, -2.0], [10.0, 20.0]], dtype=np.float32)
    how = {"crs": "EPSG:4326", "transform": Affine(0.2, 0.0, 6.0, 0.0, -0.2, 49.4), "dtype": "float32"}
    with rasterio.open(path, "w", driver="GTiff", height=2, width=2, count=1, **how) as file:
        file.write(values, 1)
    ground = read_ground(path)
    assert ground.range_over(shapely.box(6.05, 49.25, 6.1, 49.3)) == (-4.0, 20.0)
    assert ground.range_over(shapely.box(6.05, 49.25, 6.5, 49.3)) is None
    with pytest.raises(FileFormatError, match="no such file"):
        read_ground(tmp_path / "none.tif")
