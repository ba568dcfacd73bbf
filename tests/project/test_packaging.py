"""What is installed is what is in the tree."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = {"cgla_graph": "cgla_graph", "solvers": "cgla_graph/solvers", "comparisons": "cgla_graph/comparisons"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy, so that nothing is left in the tree."""
    copy = tmp_path_factory.mktemp("tree")
    for name in (*FOLDERS, "pyproject.toml", "README.md", "LICENSE"):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, copy / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, copy / name)
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(copy / "dist"), str(copy)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return next((copy / "dist").glob("*.whl"))


@pytest.mark.slow
def test_the_wheel_holds_the_tree(wheel: Path) -> None:
    """Every module, scenario and marker file is in the wheel once, and nothing else is."""
    expected = set()
    for folder, package in FOLDERS.items():
        for file in (ROOT / folder).rglob("*"):
            inside = file.relative_to(ROOT / folder)
            # pictures are the README's
            if file.is_file() and not {"__pycache__", "pictures"} & {*inside.parts} and inside.parts[0] not in FOLDERS:
                expected.add(f"{package}/{inside.as_posix()}")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()

    assert len(names) == len(set(names))
    assert {name for name in names if ".dist-info/" not in name} == expected


@pytest.mark.slow
def test_the_wheel_works_without_the_tree(wheel: Path, tmp_path: Path) -> None:
    """Installed elsewhere, the package imports from there and plans a path."""
    site = tmp_path / "site"
    options = ["--quiet", "--no-deps", "--no-compile", "--target", str(site)]
    install = [sys.executable, "-m", "pip", "install", *options, str(wheel)]
    subprocess.run(install, check=True, capture_output=True)
    script = (
        "import cgla_graph as cg, sys; from cgla_graph.comparisons.cli.app import main; "
        "print(cg.__file__, file=sys.stderr); "
        "print(cg.solve(cg.load_scenario('one-threat').problem, 'dijkstra', resolution=5).status.name); "
        "sys.argv[1:] = ['scenarios', '--json']; main()"
    )
    environment = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)

    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith(str(site))
    assert done.stdout.startswith("OPTIMAL\n")
    assert '"one-threat"' in done.stdout
