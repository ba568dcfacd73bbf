"""What is installed, read once until an installation changes it."""

import sys
from collections.abc import Callable
from functools import lru_cache, wraps
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")


def read_once(read: Callable[[str], T]) -> Callable[[str], T]:
    """
    Keep what a function reads about installed packages until one of their folders changes.

    Reading takes milliseconds; an installation changes the folder of packages that it is made in.

    Examples
    --------
    >>> from importlib import metadata
    >>> version = read_once(metadata.version)
    >>> version("numpy") is version("numpy")
    True
    """

    @lru_cache(maxsize=256)
    def kept(name: str, *_: tuple[object, ...]) -> T:
        return read(name)

    @wraps(read)
    def wrapper(name: str) -> T:
        return kept(name, tuple(map(_place, sys.path)), tuple(map(id, sys.meta_path)))

    return wrapper


def _place(path: str) -> tuple[object, ...]:
    """Return a folder of packages and when it last changed; the name alone where there is none."""
    try:
        found = Path(path).stat()
    except (OSError, TypeError, ValueError):
        return (path,)
    return path, found.st_dev, found.st_ino, found.st_mtime_ns
