"""Compiled kernels of this run, but for some: what it is like when those have to be compiled."""

import os
import shutil
from pathlib import Path


def kept_but_for(*names: str, at: Path) -> dict[str, str]:
    """
    Copy the machine code that is on disk, without that of kernels whose `module.function` begins so.

    Returns
    -------
    environment
        Of a process that finds the rest in folder `at`.
    """
    kept = os.environ.get("NUMBA_CACHE_DIR")
    if kept is not None and Path(kept).is_dir():

        def left_out(_: str, files: list[str]) -> set[str]:
            return {file for file in files if file.startswith(names)}

        # (files are replaced, never written to)
        shutil.copytree(kept, at, ignore=left_out, copy_function=os.link)
    return {**os.environ, "NUMBA_CACHE_DIR": str(at)}
