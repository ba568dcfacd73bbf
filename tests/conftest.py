"""Settings of all tests."""

import gc
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
import strategies  # noqa: F401 - how examples are drawn is settled before any test is imported

# What a script starts in the background ignores Ctrl-C, and what nohup starts a terminal that is closed; so would the
# programs that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


#: Files of tests that take longest: they are begun first, so that none of them is left alone at the end.
LONGEST = (
    "project/test_readme.py",
    "comparisons/cli/test_app.py",
    "scenarios/test_mission_file.py",
    "cost_to_go/test_repair.py",
    "fusion/test_fusion.py",
    "solvers/test_rasters.py",
    "certificate/test_certificate.py",
    "mission/test_mission.py",
    "eikonal/test_mesh.py",
    "certificate/test_corners.py",
    "certificate/test_tips.py",
    "motion/test_space_time.py",
    "comparisons/workers/test_cluster.py",
    "comparisons/claims/test_claims_command.py",
    "comparisons/claims/test_obstacle_claims.py",
    "comparisons/report/test_report_browser.py",
    "solvers/grid/test_skimage_route.py",
    "test_kernel.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest files; workers take files in the order in which they are collected."""
    ranks = {Path(__file__).parent / name: rank for rank, name in enumerate(LONGEST)}
    if gone := [path for path in ranks if not path.exists()]:
        msg = f"{gone[0]} is not there; mend LONGEST"
        raise pytest.UsageError(msg)
    items.sort(key=lambda item: ranks.get(item.path, len(ranks)))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep what collecting makes from being looked through for garbage, then and again and again while tests run."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Let all of it go at the end: compiled libraries look for what is left of theirs."""
    gc.unfreeze()


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a disk of 64 KiB, where that is allowed."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount, unmount = shutil.which("mount"), shutil.which("umount")
    if not sys.platform.startswith("linux") or mount is None or unmount is None:
        pytest.skip("no tmpfs on this system")
    words = [mount, "-t", "tmpfs", "-o", "size=64k", "none", str(disk)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"a small disk cannot be mounted: {done.stderr.strip()}")
    yield disk
    subprocess.run([unmount, str(disk)], check=True)
