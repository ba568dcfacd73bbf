"""The file of built-in solvers agrees with the solvers, and lists are shown without importing them."""

import subprocess
import sys

from cgla_graph.scenarios import shipped
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import listing, registry, write_listing


def test_the_file_is_what_the_solvers_say() -> None:
    text = (listing.resources.files("cgla_graph.solvers") / listing.FILE).read_text(encoding="utf-8")
    due = "python -m cgla_graph.solvers.write_listing writes it anew"
    assert text == write_listing.listing_text(), due
    assert [listing.describe(name) for name in listing.built_in()] == [
        registry.describe(name) for name in registry.names(installed=False)
    ]


def test_lists_of_files_are_what_the_files_hold() -> None:
    for line in shipped.scenario_list():
        scenario = load_scenario(line["name"])
        assert (line["title"], line["notes"]) == (scenario.title, scenario.notes)
    for line in shipped.mission_list():
        mission = load_mission(line["name"])
        assert line["variants"] == [name for name in mission.variants if name]
        assert {line["uavs"]} == {len(variant.uavs) for variant in mission.variants.values()}


def test_lists_need_no_number_crunching() -> None:
    """Libraries that take a second to import are not imported, so that lists take a fraction of one."""
    code = (
        "import sys\nfrom cgla_graph.comparisons.cli.app import app\n"
        "for name in ('solvers', 'scenarios', 'missions'):\n    app([name], standalone_mode=False)\n"
        "print([name for name in ('numpy', 'numba', 'scipy', 'shapely') if name in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == "[]"
