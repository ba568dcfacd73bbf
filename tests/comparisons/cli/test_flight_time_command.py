"""`cgla plan` and `cgla check` with --speed, --power and --battery."""

import json

import pytest
from command_line import Call

AREA = [[[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]]
FILES = {
    "areas.geojson": json.dumps({"type": "Polygon", "coordinates": AREA}),
    "bare.csv": "longitude,latitude\n24.7,60.05\n25.2,60.05\n",
}
QUICK = ("--solver", "visibility-graph", "--no-certificate", "--start", "24.7,60.12", "--goal", "25.2,60.15")
DRONE = ("--speed", 15, "--power", 300)
RATES = ("--climb-rate", 3, "--descent-rate", 2)


@pytest.mark.parametrize(
    ("more", "code", "within"),
    [
        ((), 0, None),
        (("--battery", 300, *RATES, "--altitude", 80), 0, True),
        (("--battery", "300 Wh", "--reserve", "90%", *RATES, "--altitude", 80), 1, False),
        (("--battery", 100), 1, False),
        (("--battery", 300), 1, None),
        (("--battery", 300, "--altitude", 80), 1, None),
        (("--wind", "0,16"), 1, None),
    ],
)
def test_the_exit_code_says_whether_it_can_be_flown(
    cgla: Call, more: tuple[object, ...], code: int, within: bool | None
) -> None:
    """What is not known does not end with 0, neither where a path is planned nor where it is checked."""
    found = cgla("plan", "areas.geojson", *QUICK, *DRONE, *more, "--json")
    assert (found.code, found.document()["flight"]["within_battery"]) == (code, within)
    assert found.document()["status"] == "found"
    checked = cgla("check", "bare.csv", "--zones", "areas.geojson", "--no-certificate", *DRONE, *more, "--json")
    document = checked.document()
    assert (checked.code, document["clean"]) == (code, code == 0)
    assert document["flight"]["within_battery"] is within


def test_what_is_printed(cgla: Call) -> None:
    out = cgla("plan", "areas.geojson", *QUICK, *DRONE, "--wind", "3,4", "--battery", 300, "--altitude", 80, *RATES).out
    assert "at an airspeed of 15 m/s, over ground 15." in out
    assert "of it 66.7 s climbing and descending" in out
    assert "240.0 Wh may be used: a battery of 300 Wh with a reserve of 20 % (default; --reserve gives another)" in out
    over = cgla("check", "bare.csv", "--zones", "areas.geojson", "--no-certificate", *DRONE, "--battery", 90).out
    assert "not clean: the battery does not last: the flight takes at least " in over


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--battery", "5000mAh"], ("--battery is '5000mAh'", "ampere-hours times volts")),
        (
            ["--speed", "12", "--power", "300", "--battery", "90", "--reserve", "20"],
            ("--reserve is 20", "0.2 for 20 %"),
        ),
        (["--speed", "12", "--power", "300", "--battery", "90", "--reserve", "some"], ("--reserve is 'some'",)),
        (["--speed", "12", "--battery", "90"], ("--battery", "--power")),
        (["--speed", "12", "--power", "300", "--reserve", "20%"], ("--reserve", "--battery")),
        (["--power", "300"], ("--power", "--speed")),
        (["--wind", "3,4"], ("--wind", "--speed")),
        (["--speed", "0"], ("--speed is 0",)),
        (["--speed", "12", "--climb-rate", "2"], ("--climb-rate", "--altitude")),
        (["--max-energy", "90"], ("--speed V", "--power W")),
        (["--max-energy", "90", "--max-length", "5"], ("--max-length and --max-energy are both given",)),
        (["--speed", "9", "--power", "9", "--max-energy", "-1"], ("max_energy is -1",)),
        (
            ["--speed", "9", "--power", "9", "--max-energy", "9", "--above", "ground", "--altitude", "80"],
            ("--max-energy with --above ground",),
        ),
        (["--speed", "5", "--wind", "3,4", "--profile", "mine.csv"], ("the wind is 5 fast",)),
    ],
)
def test_nonsense_is_refused_before_the_work(cgla: Call, words: list[str], said: tuple[str, ...]) -> None:
    cgla("plan", "areas.geojson", *QUICK, *words).refused(*said)


def test_a_budget_of_energy(cgla: Call) -> None:
    """The energy of the flight is kept, that of an exported plan too."""
    budget = ("--max-energy", 190, "--altitude", 80, *RATES, "--wind", "3,-4")
    for export in ((), ("--export", "mine.plan")):
        found = cgla("plan", "areas.geojson", *QUICK, *DRONE, *budget, *export, "--json")
        document = found.document()
        assert found.code == 0
        assert document["within"]["limited"] == "energy"
        assert document["flight"]["energy_wh"] <= 190.0
        assert "no flight within 190 Wh is longer than" in document["message"]
    out = cgla("plan", "areas.geojson", *QUICK, *DRONE, *budget).out
    assert "budget     energy at most 190 Wh" in out
    none = cgla("plan", "areas.geojson", *QUICK, *DRONE, "--max-energy", 9)
    assert (none.code, "it is proven that no path inside the bounds keeps the budget" in none.out) == (1, True)
