"""The table of solvers: names, settings, missing packages, and plug-ins."""

import dataclasses
import importlib.util
import json
import re
import subprocess
import sys
from collections.abc import Callable
from importlib import metadata
from importlib.machinery import ModuleSpec
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Literal, get_args

import pytest

from cgla_graph.errors import SolverSettingError, SolverUnavailableError, UnknownSolverError
from cgla_graph.model.solver import Traits
from cgla_graph.solvers import listing, registry

PlugIns = Callable[..., None]


@pytest.fixture
def plug_ins(monkeypatch: pytest.MonkeyPatch) -> PlugIns:
    """Install entry points, given as ``name="module:attribute"``."""

    def install(**values: str) -> None:
        points = [EntryPoint(name, value, listing.ENTRY_POINT_GROUP) for name, value in values.items()]
        monkeypatch.setattr(listing, "entry_points", lambda **_: points)

    return install


@pytest.fixture
def no_ompl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make OMPL look like a package that is not installed."""

    def find(name: str, package: str | None = None) -> ModuleSpec | None:
        return None if name.partition(".")[0] == "ompl" else importlib.util.find_spec(name, package)

    monkeypatch.setattr(listing, "find_spec", find)


#: The solvers that need OMPL.
OMPL = {"rrt-star", "informed-rrt-star", "sorrt-star", "bit-star", "fmt-star", "bfmt-star", "ompl-prm-star"}
#: Those of the extras ``graphs`` and ``skimage``.
OF_EXTRAS = {"networkit", "igraph", "rustworkx", "skimage-route"}


def test_plug_ins_are_read_once_until_a_folder_of_packages_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads, read = [], metadata.entry_points

    def counted(*, group: str) -> metadata.EntryPoints:
        reads.append(group)
        return read(group=group)

    monkeypatch.setattr(metadata, "entry_points", counted)
    monkeypatch.syspath_prepend(tmp_path)
    assert not [point.name for point in listing.entry_points(listing.ENTRY_POINT_GROUP)]
    n_reads = len(reads)
    assert not [point.name for point in listing.entry_points(listing.ENTRY_POINT_GROUP)]
    assert len(reads) == n_reads == 1
    # a folder that is there already gets a distribution
    about = tmp_path / "own-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: own\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text("[cgla_graph.solvers]\nown = own:Own\n", encoding="utf-8")
    assert [point.name for point in listing.entry_points(listing.ENTRY_POINT_GROUP)] == ["own"]
    assert "own" in registry.names(installed=False)


def test_the_promised_names_are_there() -> None:
    native = {"cgla", "dijkstra", "networkx", "networkx-astar", "eight-direction", "lazy-theta-star", "straight-line"}
    of_the_plane = {"refine", "hybrid", "fast-marching", "prm-star"}
    assert native | of_the_plane | OMPL | OF_EXTRAS <= set(registry.names(installed=False))


@pytest.mark.parametrize("name", registry.names(installed=False))
def test_every_row_leads_to_a_solver_of_that_name(name: str) -> None:
    kind, traits = registry.solver_class(name), registry.traits(name)
    assert traits.name == name
    assert traits.domain in get_args(Traits.__annotations__["domain"])
    assert traits.summary
    assert "\n" not in traits.summary
    assert dataclasses.is_dataclass(kind)
    assert ("seed" in registry.setting_names(kind)) == traits.seeded


@pytest.mark.parametrize("name", registry.names())
def test_solvers_are_frozen_and_equal_by_their_settings(name: str) -> None:
    solver = registry.get(name)
    assert solver == registry.get(name)
    assert hash(solver) == hash(registry.get(name))
    setting: Any = next(iter(registry.setting_names(type(solver))), "seed")
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(solver, setting, 1)


@pytest.mark.parametrize(
    ("name", "near"), [("cgl", "cgla"), ("djikstra", "dijkstra"), ("rrtstar", "rrt-star"), ("eightdirection", "eight")]
)
def test_unknown_solver_offers_the_nearest(name: str, near: str) -> None:
    for ask in (registry.solver_class, registry.traits, registry.missing, registry.get):
        with pytest.raises(UnknownSolverError, match=near) as caught:
            ask(name)
        assert repr(name) in str(caught.value)
        assert isinstance(caught.value, KeyError)


def test_a_name_like_no_other_gets_the_whole_list() -> None:
    with pytest.raises(UnknownSolverError) as caught:
        registry.get("\N{SNOWMAN}")
    assert all(name in str(caught.value) for name in registry.names(installed=False))


@pytest.mark.parametrize(
    ("name", "settings", "words"),
    [
        ("cgla", {"scheduel": "sweeps"}, "scheduel"),
        ("dijkstra", {"anything": 1}, "none"),
        ("cgla", {"schedule": "bogus"}, "label-setting"),
        ("cgla", {"traits": None}, "traits"),
    ],
)
def test_wrong_settings(name: str, settings: dict[str, Any], words: str) -> None:
    with pytest.raises(SolverSettingError, match=words) as caught:
        registry.get(name, **settings)
    assert str(caught.value).startswith(name)


@pytest.mark.usefixtures("no_ompl")
def test_without_ompl_its_solvers_are_named_with_the_reason() -> None:
    gone = set(registry.names(installed=False)) - set(registry.names())
    assert OMPL <= gone <= OMPL | OF_EXTRAS
    for name in OMPL:
        assert "ompl" in str(registry.missing(name))
        assert "pip install ompl" in str(registry.missing(name))
        with pytest.raises(SolverUnavailableError, match=rf"{name}.*ompl") as caught:
            registry.get(name)
        assert isinstance(caught.value, ImportError)
    assert registry.missing("cgla") is None


def test_who_lacks_scikit_image_is_told_what_pip_calls_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        listing, "find_spec", lambda name: None if name == "skimage" else importlib.util.find_spec(name)
    )
    assert registry.missing("skimage-route") == "needs scikit-image, which is not installed (pip install scikit-image)"


BLOCKED = """
import json, sys

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "ompl":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Block())
sys.modules.pop("ompl", None)
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name == "ompl" else found(name, package)
from cgla_graph.comparisons.cli.app import main
sys.argv = ["cgla", "compare", "one-threat", "--resolution", "4", "--seeds", "2", "--json", "--workers", "0"]
main()
"""


@pytest.mark.slow
def test_a_process_without_ompl_runs_everything_else(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    rows = json.loads(done.stdout)["rows"]
    states = {row["solver"]: row["status"] for row in rows}
    assert {states.pop(name) for name in OMPL} == {"unavailable"}
    assert {states.pop(name) for name in OF_EXTRAS} <= {"unavailable", "optimal", "found"}
    stuck = {name for name, state in states.items() if state == "stuck"}
    assert set(states.values()) <= {"optimal", "found", "stuck"}
    assert not any(registry.traits(name).complete for name in stuck)
    assert len(states) >= 5
    assert all("ompl" in row["message"] for row in rows if row["solver"] in OMPL)


def test_a_plug_in_is_a_solver_like_any_other(plug_ins: PlugIns) -> None:
    plug_ins(mine="cgla_graph.solvers.exact.dijkstra:Dijkstra")
    assert registry.names()[-1] == "mine"
    assert registry.get("mine") == registry.get("dijkstra")


def test_a_built_in_wins_over_a_plug_in(plug_ins: PlugIns) -> None:
    plug_ins(cgla="cgla_graph.solvers.exact.dijkstra:Dijkstra")
    assert registry.traits("cgla").name == "cgla"
    assert registry.names().count("cgla") == 1


@pytest.mark.parametrize(
    "value",
    ["no_such_module_of_anyone:Solver", "cgla_graph.solvers.exact.dijkstra:NoSuchClass", "json:loads", "json"],
)
def test_a_plug_in_that_is_no_solver_is_missing(plug_ins: PlugIns, value: str) -> None:
    plug_ins(broken=value)
    assert "broken" not in registry.names()
    assert "broken" in registry.names(installed=False)
    assert f"'broken' ({value})" in str(registry.missing("broken"))
    with pytest.raises(SolverUnavailableError, match=value):
        registry.get("broken")


def test_a_needed_submodule_may_be_missing_too(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = registry.solver_class("dijkstra")
    monkeypatch.setattr(kind, "traits", dataclasses.replace(kind.traits, needs=("no_such_parent.child",)))
    assert "no_such_parent.child" in str(registry.missing("dijkstra"))


@pytest.mark.parametrize(
    ("settings", "wrong"),
    [
        ({"steps": 3, "gain": 2, "mode": "slow", "limit": None}, ""),
        ({"steps": 3.5}, "steps is 3.5; its type is int"),
        ({"steps": True}, "steps is True"),
        ({"gain": "much"}, "gain is 'much'; its type is float"),
        ({"mode": "quick"}, "mode is 'quick'"),
        ({"limit": "never"}, "limit is 'never'"),
    ],
)
def test_settings_of_plug_ins_are_held_against_their_hints(
    settings: dict[str, object], wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    point = EntryPoint("hinted", "hinted_plug_in:Hinted", listing.ENTRY_POINT_GROUP)
    monkeypatch.setitem(sys.modules, "hinted_plug_in", SimpleNamespace(Hinted=Hinted))
    monkeypatch.setattr(listing, "entry_points", lambda **_: [point])
    if wrong:
        with pytest.raises(SolverSettingError, match=re.escape(wrong)):
            registry.get("hinted", **settings)
    else:
        assert registry.get("hinted", **settings) == Hinted(**settings)  # type: ignore[arg-type]


@dataclasses.dataclass(frozen=True)
class Hinted:
    """A solver of another distribution."""

    traits: ClassVar[Traits] = Traits("hinted", "has hints", domain="plane")
    steps: int = 1
    gain: float = 1.0
    mode: Literal["slow", "fast"] = "fast"
    limit: float | None = 1.0
