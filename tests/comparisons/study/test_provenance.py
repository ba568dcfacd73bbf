"""Provenance: versions, the machine, and the git revision of the source tree that is in use."""

import importlib.metadata
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import cgla_graph
from cgla_graph.comparisons.study import provenance as module
from cgla_graph.comparisons.study.provenance import Revision, machine, packages, revision, session

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


def git(folder: Path, *words: str) -> str:
    quiet = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
    who = ["-c", "user.name=Me", "-c", "user.email=me@example.org", "-c", "init.defaultBranch=main"]
    program = shutil.which("git") or "git"
    done = subprocess.run(
        [program, "-C", str(folder), *who, *words], capture_output=True, check=True, text=True, env=os.environ | quiet
    )
    return done.stdout.strip()


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Make a checkout with one commit of one file."""
    folder = tmp_path / "a tree"
    folder.mkdir()
    git(folder, "init", "--quiet")
    (folder / "code.py").write_text("x = 1\n", encoding="utf-8")
    git(folder, "add", "code.py")
    git(folder, "commit", "--quiet", "--message", "first")
    return folder


@needs_git
def test_a_clean_checkout_is_its_commit_and_later_commits_have_greater_counts(tree: Path) -> None:
    """Planner Arena orders versions by the numbers in them."""
    for count in (1, 2, 3):
        found = revision(tree / "code.py")
        assert found == Revision(git(tree, "rev-parse", "HEAD"), count, dirty=False)
        assert str(found) == found.commit
        assert re.fullmatch(rf"{count}\.g[0-9a-f]{{9}}", found.local_version)
        git(tree, "commit", "--quiet", "--allow-empty", "--message", "later")


@needs_git
@pytest.mark.parametrize("change", ["edited", "staged", "removed", "new file"])
def test_any_change_is_dirty(tree: Path, change: str) -> None:
    if change == "new file":
        (tree / "more.py").touch()
    elif change == "removed":
        (tree / "more.py").touch()
        git(tree, "add", "more.py")
        git(tree, "commit", "--quiet", "--message", "second")
        (tree / "more.py").unlink()
    else:
        (tree / "code.py").write_text("x = 2\n", encoding="utf-8")
        if change == "staged":
            git(tree, "add", "code.py")
    found = revision(tree / "code.py")
    assert found is not None
    assert found.dirty
    assert str(found).endswith(" (dirty)")
    assert found.local_version.endswith(".dirty")


@needs_git
def test_files_outside_a_checkout_have_no_revision(tree: Path, tmp_path: Path) -> None:
    installed = tree / "venv" / "package.py"
    installed.parent.mkdir()
    installed.touch()
    assert revision(installed) is None
    outside = tmp_path / "outside.py"
    outside.touch()
    assert revision(outside) is None
    empty = tmp_path / "empty"
    empty.mkdir()
    git(empty, "init", "--quiet")
    (empty / "code.py").touch()
    assert revision(empty / "code.py") is None
    assert revision(tmp_path / "missing" / "code.py") is None


@needs_git
def test_a_link_into_a_checkout_leads_there(tree: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(tree)
    assert revision(link / "code.py") == revision(tree / "code.py")


@needs_git
def test_another_repository_in_the_environment_is_not_asked(
    tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a hook, where git sets them."""
    expected = revision(tree / "code.py")
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "nowhere"))
    monkeypatch.setenv("GIT_WORK_TREE", str(tmp_path))
    assert revision(tree / "code.py") == expected


@needs_git
def test_asking_writes_nothing(tree: Path) -> None:
    # a file whose time changed makes git want to refresh its index
    os.utime(tree / "code.py", (1, 1))
    before = {path: path.stat().st_mtime_ns for path in tree.rglob("*")}
    assert revision(tree / "code.py") is not None
    assert {path: path.stat().st_mtime_ns for path in tree.rglob("*")} == before


def test_without_git_there_is_no_revision(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert revision(Path(cgla_graph.__file__)) is None
    monkeypatch.undo()
    # a program called git may do anything
    broken = tmp_path / "git"
    broken.write_text("no program", encoding="utf-8")
    broken.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _: str(broken))
    assert revision(Path(cgla_graph.__file__)) is None


def test_git_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    slow = tmp_path / "git"
    slow.write_text("#!/bin/sh\nexec sleep 60\n", encoding="utf-8")
    slow.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda _: str(slow))
    monkeypatch.setattr(module, "_PATIENCE", 0.2)
    assert revision(Path(cgla_graph.__file__)) is None


def test_provenance_says_what_runs_here() -> None:
    here = session(3, workers="2", command="cgla caf\udce9", source="nul\0")
    assert (here.number, here.workers, here.command, here.source) == (3, "2", r"cgla caf\udce9", r"nul\x00")
    assert here.version == cgla_graph.__version__
    assert here.host
    assert here.packages["numpy"] == np.__version__
    assert here.packages == packages()
    assert "\n" not in here.machine == machine()
    assert here.label.startswith(f"CGLA-Graph {cgla_graph.__version__}")


def test_packages_of_extras_are_not_listed_except_graph_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = ['scipy>=1; extra == "graphs"', 'hypothesis>=6; extra == "dev"', "networkx>=3"]
    monkeypatch.setattr("importlib.metadata.requires", lambda _: listed)
    assert packages().keys() == {"python", "scipy", "networkx"}


def test_a_tree_that_is_not_installed_lists_its_packages_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", missing)
    assert packages()["numpy"] == np.__version__


def test_a_label_without_a_revision_is_name_and_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "revision", lambda _: None)
    assert (session(1).label, session(1).git) == (f"CGLA-Graph {cgla_graph.__version__}", "")
