"""Costly checks are run again where what they look at has changed, and only there."""

import importlib.metadata
import re
from pathlib import Path

import digests
import pytest
from digests import CHECKS, ROOT, Check

KERNELS = CHECKS["bounds"]


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a tree of a few sources whose checks have all passed."""
    for name in ("cgla_graph/_kernel.py", "cgla_graph/model/risk_kernels.py", "solvers/grid/walk_kernels.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("before\n", encoding="utf-8")
    (tmp_path / "cgla_graph/solvers").symlink_to("../solvers")
    (tmp_path / "cgla_graph/model/risk.py").write_text("before\n", encoding="utf-8")
    (tmp_path / "tests").mkdir()
    monkeypatch.setenv("CGLA_DIGESTS", "write")
    assert digests.main(["bounds"], lambda _: 0, tmp_path) == 0
    monkeypatch.setenv("CGLA_DIGESTS", "read")
    return tmp_path


def runs(tree: Path) -> bool:
    """Tell whether CI checks kernels."""
    seen: list[Check] = []
    assert digests.main(["bounds"], lambda check: seen.append(check) or 0, tree) == 0
    return bool(seen)


@pytest.mark.parametrize(
    ("name", "again"),
    [
        ("cgla_graph/_kernel.py", True),
        ("cgla_graph/model/risk_kernels.py", True),
        ("solvers/grid/walk_kernels.py", True),
        ("solvers/grid/new_kernels.py", True),
        ("cgla_graph/model/risk.py", False),
    ],
)
def test_a_changed_kernel_makes_ci_check_kernels(tree: Path, name: str, again: bool) -> None:
    assert not runs(tree)
    (tree / name).write_text("after\n", encoding="utf-8")
    assert runs(tree) == again


def test_only_tests_that_have_passed_are_left_out(tree: Path) -> None:
    assert digests.passed(["bounds", "browser"], tree) == ["bounds"]
    (tree / "cgla_graph/_kernel.py").write_text("after\n", encoding="utf-8")
    assert digests.passed(["bounds", "browser"], tree) == []


def test_so_does_another_numba_or_list_of_tests(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as other:
        other.setattr(importlib.metadata, "version", lambda _: "0.0")
        assert runs(tree)
    monkeypatch.setitem(CHECKS, "bounds", Check(KERNELS.sources, KERNELS.words[1:], packages=KERNELS.packages))  # type: ignore[arg-type]
    assert runs(tree)


DOCSTRING = '''
def least() -> int:
    """
    Return {said}.

    Examples
    --------
    >>> least()
    {shown}
    """
    return {value}
'''


@pytest.mark.parametrize(
    ("change", "again"), [({"shown": "2"}, False), ({"said": "the least"}, True), ({"value": "2"}, True)]
)
def test_examples_in_docstrings_alone_do_not_count(tree: Path, change: dict[str, str], again: bool) -> None:
    kernels, before = tree / "solvers/grid/walk_kernels.py", {"said": "one", "shown": "1", "value": "1"}
    kernels.write_text(DOCSTRING.format(**before), encoding="utf-8")
    digests.kept("bounds", tree).write_text(digests.digest(KERNELS, tree), encoding="ascii")
    kernels.write_text(DOCSTRING.format(**before | change), encoding="utf-8")
    assert runs(tree) == again


def test_files_that_checks_leave_out_exist() -> None:
    patterns = {one for check in CHECKS.values() for one in check.without}
    assert [one for one in patterns if not any(ROOT.glob(one))] == []


def test_a_digest_is_written_after_a_pass_only(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tree / "cgla_graph/_kernel.py").write_text("after\n", encoding="utf-8")
    assert digests.main(["bounds"], lambda _: 0, tree) == 0
    monkeypatch.setenv("CGLA_DIGESTS", "write")
    assert digests.main(["bounds"], lambda _: 3, tree) == 3
    assert not digests.has_passed("bounds", tree)
    # what is changed meanwhile has not passed
    assert digests.main(["bounds"], lambda _: (tree / "cgla_graph/_kernel.py").write_text("later") and 0, tree) == 0
    assert not digests.has_passed("bounds", tree)
    assert digests.main(["bounds"], lambda _: 0, tree) == 0
    assert digests.has_passed("bounds", tree)


def test_every_kernel_and_every_test_is_there() -> None:
    """A kernel in a file of another name would not be seen."""
    folders = [ROOT / name for name in ("cgla_graph", "solvers", "comparisons")]
    for path in (path for folder in folders for path in folder.rglob("*.py")):
        if re.search(r"^\s*@kernel\b", path.read_text(encoding="utf-8"), re.MULTILINE):
            assert path.resolve() in {file.resolve() for file in digests.files_of(KERNELS)}, path
    for check in CHECKS.values():
        assert digests.files_of(check)
        assert all((ROOT / word).exists() for word in check.words if word.startswith("tests/"))


def test_a_comparison_counts_planners_and_no_flight_plans() -> None:
    counted = {file.relative_to(ROOT).as_posix() for file in digests.files_of(CHECKS["comparison"])}
    assert {"cgla_graph/model/risk.py", "solvers/solving.py", "solvers/grid/theta_kernels.py"} <= counted
    assert not [name for name in counted if name.startswith(("cgla_graph/airspace/", "solvers/trade_off/"))]


def test_proofs_count_what_they_look_at_and_no_flights() -> None:
    counted = {file.relative_to(ROOT).as_posix() for file in digests.files_of(CHECKS["proofs"])}
    assert {"cgla_graph/model/risk.py", "solvers/trade_off/constrained.py", "tests/support/oracles.py"} <= counted
    assert all(any(name.startswith(word) for name in counted) for word in CHECKS["proofs"].words)
    assert not [name for name in counted if name.startswith(("cgla_graph/timed/", "cgla_graph/airspace/"))]


def test_blocks_of_the_manual_count_pages_and_all_code() -> None:
    counted = {file.relative_to(ROOT).as_posix() for file in digests.files_of(CHECKS["manual"])}
    assert {"README.md", "docs/tutorials/mission.md", "comparisons/cli/app.py", "docs/figures/bracket.py"} <= counted
    assert not [name for name in counted if name.startswith("tests/solvers/")]


def test_tests_of_solvers_look_at_what_counts_alone() -> None:
    """Those that look at studies or at the command line belong to the rest of the suite."""
    counted = {file.relative_to(ROOT).as_posix() for file in digests.files_of(CHECKS["solvers"])}
    tests = [ROOT / name for name in counted if name.startswith(("tests/solvers/", "tests/timed/"))]
    assert len(tests) > 40
    for path in tests:
        outside = r"cgla_graph\.(comparisons|fusion|networkx_backend)\b|cg\.comparisons|command_line"
        assert not re.search(outside, path.read_text(encoding="utf-8")), path


def test_the_rest_of_the_suite_leaves_out_the_tests_of_checks_alone() -> None:
    assert digests.others(["browser", "paper"]) == " ".join(
        f"--ignore={name}" for name in (*digests.OF_PAGES, "tests/comparisons/claims")
    )
    assert not [
        word
        for name in ("browser", "paper", "proofs", "solvers", "manual")
        for word in CHECKS[name].words
        if word[:6] != "tests/"
    ]


def test_ci_asks_for_all_of_them() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert re.search(rf"^{' '.join(CHECKS)}: ", makefile, re.MULTILINE)
    for line in ("check: lint checks", "checks: suite bounds browser paper proofs solvers manual"):
        assert line in makefile.splitlines()
    assert {"export CGLA_DIGESTS=read", "make lint &", 'wait "$linted"'} <= {*script.splitlines()}
    assert re.search(r"^make .* checks comparison docs$", script, re.MULTILINE)
