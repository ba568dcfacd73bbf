"""
Costly checks, which `make test` and CI repeat only where what they look at has changed.

``digests.py CHECK …`` runs the checks. With ``CGLA_DIGESTS=read`` it leaves out those whose digest is the one in
``tests/digests``; with ``CGLA_DIGESTS=write`` it writes the digest of each that has passed (``make digests``).
``digests.py --passed CHECK`` runs nothing, and fails if CHECK would have to run. ``digests.py --others CHECK …`` prints
the options by which pytest runs all other tests, ``digests.py --due CHECK …`` those by which it leaves out the tests of
checks that have passed.

Examples in docstrings do not count: none of these checks runs them, and the other tests always do.
"""

import ast
import hashlib
import importlib.metadata
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Tests of kernels, which also have to read and write inside their arrays: once, with that checked.
OF_KERNELS = tuple(
    f"tests/{name}.py"
    for name in (
        "model/test_risk", "model/test_risk_raster", "model/test_no_fly", "model/test_graph",
        "cost_to_go/test_cost_matrix", "cost_to_go/test_repair",
        "theorem_1/test_part_1_least_costs", "theorem_1/test_delta_sets", "theorem_1/test_part_3_early_stop",
        "eikonal/test_mesh", "eikonal/test_marching_kernels", "eikonal/test_queue_kernels",
        "certificate/test_certificate_kernels", "certificate/test_tips", "certificate/test_corners",
        "fusion/test_fusion", "motion/test_trajectory", "motion/test_space_time",
        "turning/test_curve", "solvers/continuous/test_roadmap_kernels",
    )
)  # fmt: skip
BROWSER = tuple(f"tests/support/{name}.py" for name in ("chromium", "live_page", "serving"))
OF_PAGES = ("tests/comparisons/report/test_report_browser.py", "tests/comparisons/live/test_live_browser.py")
#: Tests of lower bounds in the plane, and of what else is said of all paths.
OF_PROOFS = tuple(f"tests/{name}" for name in ("certificate", "eikonal", "regions", "restricted"))
#: Tests of solvers, and of flights in time; those that look at the command line and at studies are not among them.
OF_SOLVERS = (
    *(
        f"tests/solvers/{name}"
        for name in (
            "continuous", "exact", "geometric", "grid", "reactive", "sampling", "trade_off", "uncertain",
        )
    ),
    *(
        f"tests/solvers/test_{name}.py"
        for name in (
            "budget", "every_solver", "hostile_maps", "isochrones", "questions", "random_problems", "rasters",
            "settings", "solver_contract",
        )
    ),
    *(
        f"tests/timed/test_{name}.py"
        for name in ("others", "planning", "space_time_proof", "teams", "timed_peers", "timed_problem", "tolls")
    ),
)  # fmt: skip
#: The blocks of the README and the manual, and its pictures.
OF_MANUAL = ("tests/project/test_blocks.py", "tests/project/test_figures.py")
#: The pages of the manual; Sphinx makes those in another folder.
PAGES = tuple(f"docs/{folder}*.md" for folder in ("", "how-it-works/", "reference/", "tutorials/"))
NUMERICS = ("numba", "numpy", "scipy", "shapely")
LIBRARY = ("cgla_graph/**/*", "solvers/**/*")
#: Parts of these that neither a comparison of planners nor a claim runs.
NOT_COMPARED = (
    *(f"cgla_graph/{name}/**/*" for name in ("airspace", "networkx_backend", "people", "testing", "timed", "turning")),
    *(f"solvers/{name}/**/*" for name in ("timed", "trade_off", "uncertain")),
    "cgla_graph/certificate/answers.py", "solvers/grouped_questions.py", "solvers/questions.py",
)  # fmt: skip
#: Parts of these that no test of solvers looks at (tests/project/test_digests.py).
NOT_SOLVED = tuple(f"cgla_graph/{name}/**/*" for name in ("fusion", "networkx_backend"))
#: Parts of these that no proof in the plane looks at.
NOT_PROVEN = (
    *(f"cgla_graph/{name}/**/*" for name in ("airspace", "fusion", "mission", "motion", "networkx_backend", "timed")),
    *(f"solvers/{name}/**/*" for name in ("timed", "uncertain")),
)  # fmt: skip


@dataclass(frozen=True)
class Check:
    """
    A costly check.

    Attributes
    ----------
    sources
        Patterns of the files that its answer follows from, below the root.
    words
        The command: arguments of pytest, or all of it if the first one is no folder or file of tests.
    environment
        What is set while it runs.
    packages
        Installed packages whose version counts as well.
    without
        Patterns of files among the sources that do not count.
    """

    sources: tuple[str, ...]
    words: tuple[str, ...]
    environment: tuple[tuple[str, str], ...] = ()
    packages: tuple[str, ...] = ()
    without: tuple[str, ...] = ()


CHECKS: Mapping[str, Check] = {
    "bounds": Check(
        ("cgla_graph/_kernel.py", *(f"{top}/**/*_kernels.py" for top in ("cgla_graph", "solvers", "comparisons"))),
        OF_KERNELS,
        # compiled in a hurry, and kept apart from unchecked code
        (("NUMBA_BOUNDSCHECK", "1"), ("NUMBA_OPT", "1"), ("NUMBA_CACHE_DIR", str(ROOT / ".venv/kernels-checked"))),
        ("numba",),
    ),
    "browser": Check(("comparisons/report/**/*", "comparisons/live/**/*", *BROWSER, *OF_PAGES), OF_PAGES),
    "paper": Check(
        ("comparisons/claims/**/*", "tests/comparisons/claims/**/*", "solvers/**/*", "cgla_graph/mission/**/*"),
        ("tests/comparisons/claims",),
        without=NOT_COMPARED,
    ),
    "proofs": Check(
        (
            *(*LIBRARY, "comparisons/study/documents.py", "examples/proofs/**/*", "tests/support/**/*"),
            *(f"{name}/**/*" for name in OF_PROOFS),
        ),
        OF_PROOFS,
        packages=("numba", "numpy", "shapely"),
        without=NOT_PROVEN,
    ),
    "solvers": Check(
        (*LIBRARY, "tests/support/**/*", *OF_SOLVERS, *(f"{name}/**/*" for name in OF_SOLVERS)),
        OF_SOLVERS,
        packages=NUMERICS,
        without=NOT_SOLVED,
    ),
    "manual": Check(
        (
            *(*LIBRARY, "comparisons/**/*", *PAGES, "README.md", "tests/support/**/*", *OF_MANUAL),
            *("docs/_extensions/manual_figures.py", "docs/figures/*"),
        ),
        OF_MANUAL,
        packages=(*NUMERICS, "matplotlib"),
    ),
    "comparison": Check(
        (*LIBRARY, "comparisons/study/**/*", "comparisons/plots/**/*"), ("make", "compare"), without=NOT_COMPARED
    ),
}


def files_of(check: Check, root: Path = ROOT) -> list[Path]:
    """List the files that a check follows from, each where it really is."""
    found, left_out = ({p for one in patterns for p in root.glob(one)} for patterns in (check.sources, check.without))
    files = (path for path in found - left_out if path.is_file())
    inside = (path for path in files if path.resolve() == root.resolve() / path.relative_to(root))
    return sorted(path for path in inside if "__pycache__" not in path.parts)


def docstrings(node: ast.AST) -> Iterator[ast.Constant]:
    """List what begins a module, its classes and their functions, where that is a string."""
    for place, one in enumerate(getattr(node, "body", ())):
        if isinstance(one, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield from docstrings(one)
        elif place == 0 and isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
            yield one.value


@cache
def without_examples(text: bytes) -> bytes:
    """Return the text of a module without the examples that end docstrings."""
    lines = text.decode().splitlines(keepends=True)
    for one in docstrings(ast.parse(text)):
        inside = range(one.lineno - 1, (one.end_lineno or one.lineno) - 1)
        begins = next((n for n in inside if lines[n].strip() == "Examples"), inside.stop)
        lines[begins : inside.stop] = [""] * (inside.stop - begins)
    return "".join(lines).encode()


def read(path: Path) -> bytes:
    """Return the text of a file; of Python, without the examples that end docstrings."""
    text = path.read_bytes()
    return without_examples(text) if path.suffix == ".py" and b"    Examples\n" in text else text


def digest(check: Check, root: Path = ROOT) -> str:
    """Return a digest of names and texts of the sources, of the command, the platform, and versions of packages."""
    versions = map(importlib.metadata.version, check.packages)
    whole = hashlib.sha256(repr((check.words, sys.platform, platform.machine(), *versions)).encode())
    for path in files_of(check, root):
        whole.update(path.relative_to(root).as_posix().encode() + b"\0" + read(path) + b"\0")
    return whole.hexdigest()


def kept(name: str, root: Path = ROOT) -> Path:
    """Return where the digest of the sources is kept that a check has passed with."""
    return root / "tests" / "digests" / name


def has_passed(name: str, root: Path = ROOT) -> bool:
    """Tell whether a check has passed with the sources that there are."""
    file = kept(name, root)
    return file.is_file() and file.read_text(encoding="ascii").strip() == digest(CHECKS[name], root)


def passed(names: Iterable[str], root: Path = ROOT) -> list[str]:
    """List those of some checks that have passed with the sources that there are."""
    return [name for name in names if has_passed(name, root)]


def perform(check: Check) -> int:
    """Run a check; return its exit status."""
    workers = os.environ.get("WORKERS", "2")
    pytest = (sys.executable, "-m", "pytest", "--numprocesses", workers, "--dist", "loadfile", "--quiet")
    words = (*pytest, *check.words) if check.words[0].startswith("tests/") else check.words
    return subprocess.run(words, cwd=ROOT, env={**os.environ, **dict(check.environment)}, check=False).returncode


def main(names: Iterable[str], run: Callable[[Check], int] = perform, root: Path = ROOT) -> int:
    """Run checks; return the exit status of the first that fails, else 0."""
    how = os.environ.get("CGLA_DIGESTS")
    for name in names:
        if how == "read" and has_passed(name, root):
            print(f"{name}: has passed with these sources, and is not run again (tests/digests/{name})", flush=True)
            continue
        before = digest(CHECKS[name], root)
        if status := run(CHECKS[name]):
            return status
        if how == "write":
            kept(name, root).parent.mkdir(exist_ok=True)
            kept(name, root).write_text(before + "\n", encoding="ascii")
    return 0


def others(names: Iterable[str]) -> str:
    """Return the options by which pytest leaves out the tests of checks."""
    return " ".join(f"--ignore={word}" for name in names for word in CHECKS[name].words)


if __name__ == "__main__":
    _, first, *more = sys.argv
    if first == "--others":
        print(others(more))
    elif first == "--due":
        print(others(passed(more)))
    else:
        sys.exit(not has_passed(more[0]) if first == "--passed" else main([first, *more]))
