"""Settings of all tests."""

import atexit
import gc
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

# A background job of a script ignores Ctrl-C, and a job of nohup ignores the end of its terminal; the programs that
# tests start and interrupt would inherit this.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def runs_tests(config: pytest.Config) -> bool:
    """Tell whether tests run in this process, which may only hand them out to workers."""
    return hasattr(config, "workerinput") or not config.getoption("numprocesses", None)


def pytest_configure(config: pytest.Config) -> None:
    """Load the profiles of hypothesis and the fixture `cgla` before any test is imported."""
    if runs_tests(config):
        for name in ("strategies", "command_line"):
            config.pluginmanager.import_plugin(name)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Exclude the objects of the collection from garbage collection, which would visit them during every test."""
    if not runs_tests(session.config):
        return (yield)
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        # (what tests make is mostly gone before: the collector need not look as often)
        gc.set_threshold(100_000, 50, 50)
        gc.enable()


# undone at the end of the process, as compiled libraries check for leaked objects, after the collections of pytest
atexit.register(gc.unfreeze)


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
