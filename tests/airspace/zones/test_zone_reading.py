"""Files of zones in all formats: valid ones are read, others are refused with the zone and the key."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest
import shapely
from hypothesis import given
from mutations import damaged, damaged_json, tried
from strategies import few
from zone_files import (
    ALWAYS,
    HOLE,
    NIGHTS,
    PUBLISHED,
    SQUARE,
    circle,
    data_of,
    ed269,
    ed318,
    geojson,
    kml,
    kmz,
    layer,
    polygon,
    volume,
)

import cgla_graph as cg
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.airspace.zones.zone import Limit, Zone
from cgla_graph.errors import FileFormatError
from cgla_graph.testing.strategies import seeds

AREA = shapely.Polygon(SQUARE, [HOLE])
DOCUMENTS = {"ED-269": ed269(), "ED-318": ed318(), "KML": kml(), "GeoJSON": geojson()}
#: Periods that begin or end by the sun or the clock.
TIMES = [
    {"day": ["SAT"], "startEvent": "SS", "endEvent": "SR"},
    {"day": ["ANY"], "startEvent": "BMCT", "endTime": "06:00+02:00"},
    {"day": ["SUN"], "startTime": "06:00", "endEvent": "EECT"},
]
FUZZED = {
    **DOCUMENTS,
    "ED-269 by the sun": ed269(volume(), volume(lowerLimit=9), applicability=[{"permanent": "NO", "schedule": TIMES}]),
    "ED-318 by the sun": ed318(limitedApplicability=[{"startDateTime": "2026-01-01T00:00:00Z", "schedule": TIMES}]),
}
#: How many zones each published file has, and its format.
CONTENTS = {"ed269-ch": 4, "ed269-fi": 2, "ed269-lu": 2, "ed318-ie": 4, "ed318-Example_Collection": 2}


def only(document: object) -> Zone:
    (zone,) = zones_of(data_of(document), "mine").zones
    return zone


def refused(document: object) -> str:
    with pytest.raises(FileFormatError) as told:
        zones_of(data_of(document), "mine")
    message = str(told.value)
    assert message.startswith(("mine: ", "'mine': "))
    assert "\n" not in message
    return message


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_the_content_says_which_format_it_is(kind: str, tmp_path: Path) -> None:
    """The format does not depend on the file's name, a byte-order mark, or an archive."""
    data = data_of(DOCUMENTS[kind])
    for name, content in {
        "a.txt": data,
        "b": b"\xef\xbb\xbf" + data,
        "c.kml": kmz(data) if kind == "KML" else data,
    }.items():
        path = tmp_path / name
        path.write_bytes(content)
        zones = cg.read_zones(path)
        assert zones.formats == {str(path): kind}
        assert zones.zones[0].layers[0].area.equals(AREA)
        assert zones.zones[0].name in {"Castle", ""}
        assert "Castle" in zones.zones[0].label


def test_data_of_ed269_are_kept() -> None:
    zone = only(ed269(volume(), volume(uomDimensions="FT", upperLimit=1000, upperVerticalReference="AMSL")))
    assert (zone.identifier, zone.kind, zone.reason) == ("A-1", "PROHIBITED", "SENSITIVE")
    assert zone.authority == "Castle office, castle@example.com"
    assert [one.upper for one in zone.layers] == [Limit(120.0, "AGL"), Limit(304.8, "AMSL")]
    bare = only({"features": [{"identifier": "A", "restriction": "prohibited", "geometry": [volume(upperLimit=None)]}]})
    assert str(bare.layers[0].upper) == "unlimited"
    assert only([*ed269()["features"]]).identifier == "A-1"


@pytest.mark.parametrize(("value", "unit"), [(99999, "M"), (99999.0, "FT"), (None, "M")])
def test_unlimited_ceilings(value: float | None, unit: str) -> None:
    assert str(only(ed269(volume(upperLimit=value, uomDimensions=unit))).layers[0].upper) == "unlimited"
    assert str(only(ed318({**circle(6, 49, 9), "layer": layer(upper=value, uom=unit)})).layers[0].upper) == "unlimited"


def test_data_of_ed318_are_kept() -> None:
    parts = [{"type": "Polygon", "coordinates": [SQUARE], "layer": layer(lower=100)}, circle(6.1, 49.1, 500)]
    zone = only(ed318({"type": "GeometryCollection", "geometries": parts}, name="plain", reason="NATURE"))
    assert (zone.name, zone.kind, zone.reason) == ("plain", "REQ_AUTHORISATION", "NATURE")
    assert [str(one.lower) for one in zone.layers] == ["30.48 m AGL", "0 m AGL"]
    assert only(ed318()).name == "Castle"
    multi = {"type": "MultiPolygon", "coordinates": [[SQUARE, HOLE], [[[7, 49], [8, 49], [8, 50], [7, 49]]]]}
    assert only(ed318(multi)).layers[0].area.area == pytest.approx(AREA.area + 0.5)


def test_placemarks_without_an_area_are_listed() -> None:
    zones = zones_of(kml(), "mine")
    assert [zone.label for zone in zones] == ["Castle", "placemark 1"]
    assert len(zones.zones[1].layers) == 2
    assert [(one.label, one.reason) for one in zones.no_areas] == [
        ("tower", "a Point, not an area"),
        ("road", "a LineString, not an area"),
    ]
    account = zones.apply().account()
    assert account.summary() == (
        "4 zones: 2 closed (2 UNCLASSIFIED), 2 left out (1 a Point, not an area, 1 a LineString, not an area)"
    )


RING = [[6, 49], [7, 49], [7, 50], [6, 49]]


def projected(**changes: object) -> dict[str, Any]:
    return ed269(volume(horizontalProjection={"type": "Polygon", "coordinates": [RING], **changes}))


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"features": []}, "features"),
        ({"features": 5}, "features: it is 5"),
        ({"features": [5]}, "zone 0: it is 5"),
        (ed269(identifier=None), "zone 0: identifier: it is null"),
        (ed269(restriction="FORBIDDEN"), "zone 0 'A-1': restriction: it is 'FORBIDDEN'"),
        (ed269(geometry=[]), "zone 0 'A-1': geometry: it is a list; give a list of at least one"),
        (ed269(geometry=None), "zone 0 'A-1': geometry: it is null"),
        (ed269(volume(uomDimensions="KM")), "geometry[0]: uomDimensions: it is 'KM'; give one of M, FT"),
        (ed269(volume(uomDimensions=None)), "geometry[0]: uomDimensions"),
        (ed269(volume(upperVerticalReference="QNH")), "geometry[0]: upperVerticalReference: it is 'QNH'"),
        (ed269(volume(lowerVerticalReference=None)), "geometry[0]: lowerVerticalReference"),
        (ed269(volume(upperLimit="120")), "geometry[0]: upperLimit: it is '120'; give a number"),
        (ed269(volume(upperLimit=True)), "geometry[0]: upperLimit: it is true"),
        (ed269(volume(lowerLimit=200)), "upperLimit: the ceiling, 120 m AGL, is below the floor, 200 m AGL"),
        (ed269(volume(horizontalProjection=None)), "horizontalProjection: it is null"),
        (projected(type="Square"), "horizontalProjection: type: it is 'Square'; give one of POLYGON, CIRCLE"),
        (projected(coordinates=[]), "horizontalProjection: coordinates"),
        (projected(coordinates=[RING[:3]]), "coordinates[0]: it has 3 positions"),
        (projected(coordinates=[[*RING[:3], [6, 50]]]), "coordinates[0]: it is open"),
        (projected(coordinates=[[[6, 49], [7, 49], [7, 91], [6, 49]]]), "coordinates[0][2]: its latitude is 91"),
        (projected(coordinates=[[[6, 49], ["7", 49], [7, 50], [6, 49]]]), "coordinates[0][1]: its longitude is '7'"),
        (projected(coordinates=RING), "coordinates[0][0]: it is 6; give [longitude, latitude]"),
        (projected(coordinates=[[[6, 49]] * 4]), "its outline encloses nothing"),
        (projected(type="Circle", center=[6, 49], radius=-1), "horizontalProjection: radius: it is -1"),
        (projected(type="Circle", center=[6], radius=1), "horizontalProjection: center: it is a list"),
        (projected(type="Circle", center=[6, 49], radius=1e6), "radius: it is 1000000.0; give metres"),
        (ed269(applicability="always"), "zone 0 'A-1': applicability: it is 'always'"),
        (ed269(applicability=[{"permanent": "MAYBE"}]), "applicability[0]: permanent: it is 'MAYBE'"),
        (
            ed269(applicability=[{"permanent": "NO", "startDateTime": "2026-08-01"}]),
            "startDateTime: it is '2026-08-01'",
        ),
        (ed269(applicability=[{"schedule": [{"day": ["MO"]}]}]), "applicability[0]: schedule[0]: day: it is 'MO'"),
        (ed269(applicability=[{"schedule": [{"day": ["ANY"], "endTime": "25:00Z"}]}]), "endTime: it is '25:00Z'"),
        (ed318(type="USPACE!"), "zone 0 'B-2': type: it is 'USPACE!'; give one of PROHIBITED"),
        (ed318(identifier=7), "zone 0: identifier: it is 7; give a text"),
        (ed318({"type": "LineString", "coordinates": RING, "layer": layer()}), "geometry: type: it is 'LineString'"),
        (ed318({"type": "Point", "coordinates": [6, 49], "layer": layer()}), "geometry: extent: it is missing"),
        (ed318({"type": "GeometryCollection", "geometries": [5]}), "geometry: geometries[0]: it is 5"),
        (ed318({**circle(6, 49, 9), "layer": layer(upperReference="X")}), "geometry: layer: upperReference: it is 'X'"),
        (ed318({**circle(6, 49, 9), "layer": 5}), "geometry: layer: it is 5"),
        (
            ed318(limitedApplicability=[{"startDateTime": {}}]),
            "limitedApplicability[0]: startDateTime: it is an object",
        ),
        ({**ed318(), "metadata": {"validFrom": {"not": "a time"}}}, "metadata: validFrom: it is an object"),
        (
            kml("<NetworkLink><name>n</name><Link><href>a.kml</href></Link></NetworkLink>"),
            "'n': its areas are in anoth",
        ),
        (kml(f"<Placemark><name>p</name>{polygon(RING)[:-10]}Polygon></Placemark>"), "not XML"),
        (
            kml(f"<Placemark><name>p</name>{polygon([[6, 49], [7, 99], [7, 50]])}</Placemark>"),
            "'p': Polygon 0: ring 0[1]",
        ),
        (kml("<Placemark><name>p</name><Polygon/></Placemark>"), "'p': Polygon 0: outerBoundaryIs: it has 0 rings"),
        (kml(f"<Foldr><Placemark>{polygon(RING)}</Placemark></Foldr>"), "it has placemarks in a <Foldr>"),
        (kml(f"<Placemark><Many>{polygon(RING)}</Many></Placemark>"), "it has a <Many> outside of a polygon"),
        (kml(f"<Placemark>{polygon(RING).replace('6,49', '6, 49')}</Placemark>"), "coordinates: one is no number"),
        (geojson([*RING[:3], [6, 50]]), "feature 0 ('Castle'), ring 0 is open"),
        (b"nothing of the kind", "none of the formats"),
        (b"", "none of the formats"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_errors_name_zone_and_key(document: object, said: str) -> None:
    assert said in refused(document)


@pytest.mark.parametrize(
    "applicability", [None, [], ALWAYS, [{"permanent": "NO"}], [{"startDateTime": "2030-01-01T00:00Z"}, *ALWAYS]]
)
def test_a_zone_without_limits_in_time_always_applies(applicability: object) -> None:
    assert only(ed269(applicability=applicability)).periods == ()


@pytest.mark.parametrize("name", CONTENTS)
def test_every_published_zone_is_accounted_for(name: str) -> None:
    path = PUBLISHED / f"{name}.json"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    zones = cg.read_zones(path)
    assert len(zones) == CONTENTS[name]
    for altitude in (None, 30, "400 AMSL", "100 HOME"):
        for at in (None, "2026-08-01T12:00+02:00", "2026-08-05T12:00Z"):
            account = zones.apply(altitude=altitude, at=at).account()
            counts = [account.count("closed"), account.count("open"), account.count("left out")]
            assert sum(counts) == CONTENTS[name] == len(account.records)
            assert account.summary().startswith(f"{CONTENTS[name]} zones: ")


def test_facts_of_published_files() -> None:
    """Check the temporary zone of Luxembourg, ceilings of Switzerland and Finland, and feet and hole of Ireland."""
    if not (PUBLISHED / "ed318-ie.json").is_file():
        pytest.skip("the published files are not there")
    files = [PUBLISHED / f"{name}.json" for name in ("ed269-lu", "ed269-ch", "ed269-fi", "ed318-ie")]
    zones = {zone.identifier: zone for zone in cg.read_zones(files)}
    assert len(zones) == 12
    assert [str(zones[name].layers[0].upper) for name in ("CH-GT9990", "FI-N-KESKUSPUISTO", "U901")] == [
        "unlimited",
        "unlimited",
        "762 m AMSL",
    ]
    states = {
        at: {one.identifier for one in cg.read_zones(files).apply(at=at).account().records if one.state == "closed"}
        for at in ("2026-08-01T12:00Z", "2026-08-05T12:00Z")
    }
    assert states["2026-08-01T12:00Z"] - states["2026-08-05T12:00Z"] == {"LU-T-002"}
    assert states["2026-08-05T12:00Z"] - states["2026-08-01T12:00Z"] == {"T901"}
    assert len(shapely.get_parts(zones["U901"].layers[0].area)[0].interiors) == 1


def test_the_published_example_that_is_wrong_is_refused() -> None:
    path = PUBLISHED / "ed318-InvalidExample_GeoZone_2_Layers.json"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    with pytest.raises(FileFormatError, match="metadata: validFrom: it is an object"):
        cg.read_zones(path)


def whole(data: bytes) -> None:
    """Read a document and check that every zone has a record."""
    zones = zones_of(data, "mine")
    for altitude, at in ((None, None), ("90 AMSL", "2026-08-01T12:00Z")):
        applied = zones.apply(altitude=altitude, at=at)
        account = applied.account()
        assert len(account.records) == len(zones) + len(zones.no_areas)
        assert all(one.area is not None and one.area.is_valid and one.area.area > 0.0 for one in applied.closed)
        json.dumps(account.document(), allow_nan=False)


@few
@given(seed=seeds)
@pytest.mark.parametrize("kind", FUZZED)
def test_damaged_files_are_read_or_refused(kind: str, seed: int) -> None:
    data = data_of(FUZZED[kind])
    documents = [damaged(data, 1000 * seed + n) for n in range(20)]
    # many documents with replaced values can be read; all their zones must have a record
    documents += (
        [damaged_json(data, 1000 * seed + n) for n in range(20)] if kind != "KML" else [kmz(d) for d in documents]
    )
    tried(whole, FileFormatError, documents)


PERIODS = {
    "endDatetime": ({"endDatetime": "2026-08-01T00:00:00Z"}, "endDateTime"),
    "enddatetime": ({"startDateTime": "2026-08-01T00:00:00Z", "enddatetime": "2026-08-02T00:00:00Z"}, "endDateTime"),
    "endDate": ({"endDate": "2026-08-01T00:00:00Z"}, "endDateTime"),
    "start_date_time": ({"start_date_time": "2026-08-01T00:00:00Z"}, "startDateTime"),
    "startTime": ({"startTime": "06:00Z"}, "startDateTime"),
    "shedule": ({"shedule": [NIGHTS]}, "schedule"),
    "Permanent": ({"Permanent": "NO"}, "permanent"),
    "starttime": ({"schedule": [{"day": ["ANY"], "starttime": "06:00Z"}]}, "startTime"),
    "EndEvent": ({"schedule": [{"day": ["ANY"], "EndEvent": "SS"}]}, "endEvent"),
}


@pytest.mark.parametrize("key", PERIODS)
def test_a_misspelt_time_is_an_error(key: str) -> None:
    """What it says would not count: the error names the key and the right one, in both standards."""
    period, right = PERIODS[key]
    for document in (ed269(applicability=[period]), ed318(limitedApplicability=[period])):
        assert f"{key!r}: there is no such key; write {right}, or leave it out" in refused(document)


def test_other_misspelt_keys_are_errors() -> None:
    assert "write applicability" in refused(ed269(applicabilty=[{"permanent": "NO"}]))
    assert "write limitedApplicability" in refused(ed318(limitedapplicability=[]))
    assert "write upperLimit" in refused(ed269(volume(upperlimit=100)))
    assert "write upperReference" in refused(ed318({**circle(6, 49, 9), "layer": layer(upperReferense="AGL")}))
    assert "write validTo" in refused({**ed318(), "metadata": {"validto": "2026-01-01T00:00:00Z"}})
    # keys that are like none of these are ignored
    assert only(ed269(volume(comment="low"), applicability=[{"permanent": "NO", "remark": "x"}], extra=1))


@pytest.mark.parametrize(
    ("properties", "more", "listed"),
    [
        ({"name": "Loviisa", "type": "R"}, {"id": "EFP20"}, ("EFP20", "Loviisa", "R")),
        ({"identifier": "X-1", "name": "Castle", "restriction": "PROHIBITED"}, {}, ("X-1", "Castle", "PROHIBITED")),
        ({"Designator": "ED-R 1", "class": "D"}, {}, ("ED-R 1", "ED-R 1", "D")),
        ({"identifier": "X-2", "type": ""}, {"id": 7}, ("X-2", "X-2", "UNCLASSIFIED")),
        ({"title": "Castle"}, {}, ("Castle", "", "UNCLASSIFIED")),
        (None, {"id": 7}, ("7", "7", "UNCLASSIFIED")),
        ({"restriction": "NO_RESTRICTION"}, {}, ("area 0", "", "NO_RESTRICTION")),
    ],
)
def test_identifiers_and_kinds_of_geojson_are_listed(
    properties: object, more: dict[str, object], listed: tuple[str, ...]
) -> None:
    """They are the words of the file: the area is closed as UNCLASSIFIED unless told otherwise."""
    zones = zones_of(data_of({**geojson(), "properties": properties, **more}), "mine")
    (record,) = zones.apply().account().records
    assert (record.identifier, record.name, record.kind) == listed
    assert (record.state, record.reason) == ("closed", "UNCLASSIFIED")
    assert zones.apply(treat={"UNCLASSIFIED": "open"}).account().count("open") == 1


@pytest.mark.parametrize(
    "schedule",
    [
        {"day": ["FRI"], "startTime": "22:00Z", "finish": "06:00Z"},
        {"day": ["FRI"], "begin": "22:00Z", "endTime": "06:00Z"},
        {"day": ["FRI"], "from": "22:00Z", "to": "06:00Z"},
        {"day": ["FRI"], "endEvent": "SS", "sunrise": True},
    ],
)
def test_a_schedule_with_a_key_that_is_not_known_says_both_ends(schedule: dict[str, object]) -> None:
    """Of the night of a Friday, the hours of Saturday were open."""
    for document in (
        ed269(applicability=[{"permanent": "NO", "schedule": [schedule]}]),
        ed318(limitedApplicability=[{"schedule": [schedule]}]),
    ):
        with pytest.raises(
            FileFormatError, match=r"schedule\[0\]: '(finish|begin|from|sunrise)': there is no such key"
        ):
            only(document)
    both = {"day": ["FRI"], "startTime": "22:00Z", "endTime": "06:00Z", "note": "at night"}
    assert len(only(ed269(applicability=[{"permanent": "NO", "schedule": [both]}])).periods) == 1


@pytest.mark.parametrize("height", [0, 120, -30.5])
def test_a_layer_without_room_is_closed_at_all_heights(height: float) -> None:
    """Floor and ceiling are both 0 in files that do not say how high a zone is."""
    flat = layer(uom="m", lower=height, upper=height)
    for document in (
        ed269(volume(lowerLimit=height, upperLimit=height)),
        ed318({"type": "Polygon", "coordinates": [SQUARE], "layer": flat}),
        ed318({"type": "MultiPolygon", "coordinates": [[SQUARE]], "layer": flat}),
        ed318({**circle(6.1, 49.1, 500.0), "layer": flat}),
    ):
        zones = zones_of(data_of(document), "mine")
        for altitude in (1, 80, "5000 AMSL"):
            account = zones.apply(altitude=altitude).account()
            assert account.count("closed") == 1
            assert "its floor and its ceiling are both" in account.notes()[0]
    thin = ed269(volume(lowerLimit=height, upperLimit=height + 1))
    assert zones_of(data_of(thin), "mine").apply(altitude=500).account().count("open") == 1


def test_a_height_without_a_unit_is_an_error() -> None:
    """A floor of 1,000 feet was read as 1,000 m."""
    bare = {key: value for key, value in layer(lower=1000, upper=2000).items() if key != "uom"}
    with pytest.raises(FileFormatError, match=r"layer: uom: it is missing; give one of M, FT"):
        only(ed318({"type": "Polygon", "coordinates": [SQUARE], "layer": bare}))
    from_ground = {"lower": 0, "lowerReference": "AGL"}
    assert only(ed318({"type": "Polygon", "coordinates": [SQUARE], "layer": from_ground})).layers[0].lower.metres == 0.0


def test_areas_in_elements_that_are_no_placemarks_are_an_error() -> None:
    """KML 2.0 may rename placemarks (Schema); their areas were left out without a word."""
    for area in (polygon(SQUARE), "<LinearRing><coordinates>6,49 7,49 7,50</coordinates></LinearRing>"):
        text = f"<Schema name='Zone' parent='Placemark'/><Zone><name>P</name>{area}</Zone>"
        with pytest.raises(FileFormatError, match="it has polygons or lines in a <Zone>"):
            zones_of(kml(text), "mine")


@pytest.mark.parametrize("text", ["", "<Folder><name>A</name></Folder>", "<Style id='a'/>"])
def test_a_map_without_placemarks_is_an_error(text: str) -> None:
    """As an empty list of zones or features is: a plan held against it was clean."""
    for data in (
        kml(text) if text else b"<kml/>",
        data_of({"features": []}),
        b'{"type":"FeatureCollection","features":[]}',
    ):
        with pytest.raises(FileFormatError, match=r"no placemark|at least one"):
            zones_of(data, "mine")


def test_an_archive_in_an_archive_is_an_error() -> None:
    """Its areas were left out without a word."""
    outer = io.BytesIO(kmz(kml()))
    with zipfile.ZipFile(outer, "a") as archive:
        archive.writestr("files/more.KMZ", kmz(kml()))
    with pytest.raises(FileFormatError, match=r"another one in it \(files/more\.KMZ\)"):
        zones_of(outer.getvalue(), "mine")
    assert len(zones_of(kmz(kml()), "mine").zones) == 2
