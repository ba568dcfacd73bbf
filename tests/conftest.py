"""Settings of all tests."""

import gc
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
import strategies  # noqa: F401 - registers the profiles of hypothesis before any test is imported
from command_line import cgla  # noqa: F401 - a fixture of many tests

# A background job of a script ignores Ctrl-C, and a job of nohup ignores the end of its terminal; the programs that
# tests start and interrupt would inherit this.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Exclude the objects of the collection from garbage collection, which would visit them during every test."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Undo the exclusion at the end, as compiled libraries check for leaked objects."""
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
