"""Old names of modules lead to the same objects, and warn."""

import importlib
import pickle
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import cgla_graph as cg
from cgla_graph._moved import MOVED, new_name
from cgla_graph.turning.curve import Curve


@pytest.mark.parametrize("old", sorted(MOVED))
def test_an_old_name_is_the_same_module(old: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, new = f"cgla_graph.{old}", importlib.import_module(f"cgla_graph.{MOVED[old]}")
    for module in [one for one in sys.modules if new_name(one)]:
        monkeypatch.delitem(sys.modules, module)
    spec = new.__spec__
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        found = importlib.import_module(name)
    assert seen[-1].category is DeprecationWarning
    # (that of a package warns, too)
    assert str(seen[-1].message).startswith(f"{name} is now {new.__name__}; ")
    assert new.__spec__ is spec
    # an old package may have the name of a function
    assert found is new or old in cg.__all__


def test_pickles_of_old_names_load() -> None:
    old = pickle.dumps(Curve()).replace(b"cgla_graph.turning.curve", b"cgla_graph.flyable.curve")
    with pytest.warns(DeprecationWarning, match="flyable"):
        assert type(pickle.loads(old)) is Curve  # noqa: S301 - our own


CHECK = """
import warnings
warnings.simplefilter("ignore")
import cgla_graph.flyable.curve, cgla_graph.zones.zone
import cgla_graph as cg
problem = cg.load_scenario("one-threat").problem
path = cg.solve(problem, "straight-line")
print(cgla_graph.flyable.curve.Curve.__module__, cg.flyable(path, turn_radius=0.01).status.label)
"""


def test_a_function_of_an_old_packages_name_can_be_called() -> None:
    done = subprocess.run([sys.executable, "-c", CHECK], capture_output=True, text=True, check=False)
    assert done.stdout == "cgla_graph.turning.curve found\n", done.stderr


def test_a_folder_left_behind_hides_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as ``zones/__pycache__`` of an older version, which Python takes for a package."""
    (tmp_path / "zones" / "__pycache__").mkdir(parents=True)
    monkeypatch.setattr(cg, "__path__", [str(tmp_path), *cg.__path__])
    for module in [one for one in sys.modules if one.startswith("cgla_graph.zones")]:
        monkeypatch.delitem(sys.modules, module)
    with pytest.warns(DeprecationWarning, match="zones"):
        assert importlib.import_module("cgla_graph.zones.reading").read_zones is cg.read_zones
