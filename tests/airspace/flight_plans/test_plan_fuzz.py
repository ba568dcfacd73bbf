"""Damaged and hostile files of plans: read, or refused in one line; `make fuzz` damages 10,000 of each format."""

import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given
from mutations import damaged, damaged_json, tried
from plan_files import FILES
from strategies import FUZZING, examples

from cgla_graph.airspace.flight_plans import kml, plan
from cgla_graph.airspace.flight_plans.formats import plan_of_bytes, text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.errors import FileFormatError, PlanError
from cgla_graph.testing.strategies import seeds


def zipped(data: bytes) -> bytes:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("doc.kml", data)
    return archive.getvalue()


ALL = {**FILES, ".kmz": zipped(FILES[".kml"])}


@pytest.mark.parametrize("kind", ALL)
@examples(40)
@given(seed=seeds)
def test_damaged_files_are_read_or_refused_in_one_line(kind: str, seed: int) -> None:
    several = range(13 * seed, 13 * seed + 13) if FUZZING else [seed]
    documents = [damaged(ALL[kind], one) for one in several]
    if kind in {".plan", ".geojson"}:
        documents += [damaged_json(ALL[kind], one) for one in several]
    assert sum(tried(lambda data: plan_of_bytes(data, f"plan{kind}"), FileFormatError, documents)) == len(documents)


def test_every_beginning_of_a_file_is_refused() -> None:
    """A file that was copied in part is not read as a shorter plan."""
    for kind in (".plan", ".kml", ".gpx", ".geojson"):
        whole = ALL[kind].rstrip()
        for length in range(0, len(whole), 17):
            with pytest.raises(FileFormatError):
                plan_of_bytes(whole[:length], f"plan{kind}")


def many(number: int) -> dict[str, bytes]:
    places = [(round(24.0 + 1e-6 * n, 6), 60.0) for n in range(number)]
    items = "\n".join(f"{n}\t0\t3\t16\t0\t0\t0\t0\t{y}\t{x}\t50\t1" for n, (x, y) in enumerate(places, start=1))
    return {
        ".waypoints": f"QGC WPL 110\n0 1 0 16 0 0 0 0 60 24 0 1\n{items}\n".encode(),
        ".csv": ("lon,lat\n" + "\n".join(f"{x},{y}" for x, y in places)).encode(),
        ".geojson": json.dumps({"type": "LineString", "coordinates": places}).encode(),
        ".kml": (
            "<kml><Placemark><LineString><coordinates>"
            + " ".join(f"{x},{y}" for x, y in places)
            + "</coordinates></LineString></Placemark></kml>"
        ).encode(),
    }


@pytest.mark.slow
def test_a_hundred_thousand_waypoints_are_read() -> None:
    assert len(plan_of_bytes(many(100_000)[".kml"], "long.kml").waypoints) == 100_000


def test_too_many_waypoints_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "MOST_WAYPOINTS", 1000)
    for kind, data in many(1003).items():
        with pytest.raises(PlanError, match="at most 1000"):
            plan_of_bytes(data, f"long{kind}")
    long = FlightPlan.along(np.ones((100, 2)), altitude=50)
    monkeypatch.setattr(kml, "_MOST_WRITTEN", 99)
    with pytest.raises(PlanError, match=r"take \.geojson"):
        text_of_plan(long, "long.kml")
