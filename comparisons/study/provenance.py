"""Provenance of results: time, versions, machine, and the git revision of the source tree."""

import importlib.metadata
import os
import platform
import re
import shutil
import socket
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import cgla_graph
from cgla_graph._installed import read_once
from cgla_graph._threads import n_cores

#: Seconds to wait for git, which answers at once or hangs (on a network drive).
_PATIENCE = 10.0


@dataclass(frozen=True)
class Revision:
    """
    The state of a git checkout.

    Attributes
    ----------
    commit
        The full hash of the commit checked out.
    count
        Number of commits up to it, itself included; it grows along a branch.
    dirty
        Whether files differ from it, or are not under version control.

    Examples
    --------
    >>> print(Revision("39789c9d" * 5, 152, dirty=True))
    39789c9d39789c9d39789c9d39789c9d39789c9d (dirty)
    """

    commit: str
    count: int
    dirty: bool

    def __str__(self) -> str:
        """Return the commit, and whether files differ from it."""
        return f"{self.commit} (dirty)" if self.dirty else self.commit

    @property
    def local_version(self) -> str:
        """
        The local part of a version, after the plus sign (PEP 440); later commits of a branch sort after earlier ones.

        Examples
        --------
        >>> Revision("39789c9d" * 5, 152, dirty=True).local_version
        '152.g39789c9d3.dirty'
        """
        return f"{self.count}.g{self.commit[:9]}" + (".dirty" if self.dirty else "")


@dataclass(frozen=True)
class Session:
    """
    One start or resumption of a study.

    Attributes
    ----------
    number
        From 1.
    started
        Time of the start, ISO 8601, UTC.
    version
        Version of this package.
    git
        Commit of the source tree, with ``(dirty)`` if files differed from it; empty without a checkout.
    host, machine
        Name of the machine that started it, and a description in one line.
    packages
        Versions of the packages in use, by name.
    workers
        Number of worker processes, or the cluster.
    command
        The command line.
    source
        The text of the study's file.
    label
        Name and version of this package in one word each.
    """

    number: int
    started: str
    version: str
    git: str
    host: str
    machine: str
    packages: Mapping[str, str]
    workers: str
    command: str
    source: str
    label: str = ""

    @property
    def revision(self) -> str:
        """The commit, shortened to 12 digits; empty if `git` is."""
        commit, *note = self.git.split(maxsplit=1)[:2] or [""]
        return " ".join([commit[:12], *note])


def session(number: int, *, workers: str = "", command: str = "", source: str = "") -> Session:
    """
    Describe this process as a session; arguments are those of `Session`.

    Examples
    --------
    >>> session(1).version == cgla_graph.__version__
    True
    """
    tree = revision(Path(cgla_graph.__file__))
    local = f"+{tree.local_version}" if tree else ""
    return Session(
        number=number,
        started=datetime.now(UTC).isoformat(timespec="seconds"),
        version=cgla_graph.__version__,
        git=str(tree or ""),
        host=visible(socket.gethostname()),
        machine=visible(machine()),
        packages=packages(),
        workers=workers,
        command=visible(command),
        source=visible(source),
        label=f"CGLA-Graph {cgla_graph.__version__}{local}",
    )


def revision(file: Path) -> Revision | None:
    """
    Return the state of the git checkout that a file belongs to.

    Parameters
    ----------
    file
        A file of the source tree.

    Returns
    -------
    revision
        None without git, a checkout or a commit, or if the file is not under version control: a package that is
        installed below a checkout is no part of it.

    Examples
    --------
    >>> revision(Path("/no/such/file")) is None
    True
    """
    file = file.resolve()
    root = _git(file.parent, "rev-parse", "--show-toplevel")
    if root is None or _git(file.parent, "ls-files", "--error-unmatch", "--", file.name) is None:
        return None
    commit = _git(file.parent, "rev-parse", "--verify", "HEAD")
    count = _git(file.parent, "rev-list", "--count", "HEAD")
    changes = _git(Path(root), "status", "--porcelain")
    if commit is None or count is None or changes is None:
        return None
    return Revision(commit, int(count), dirty=bool(changes))


def _git(folder: Path, *words: str) -> str | None:
    """Run git and return its output; None if it fails."""
    program = shutil.which("git")
    if program is None or not folder.is_dir():
        return None
    # a hook's environment may name another repository, and asking must not write into this one
    environment = {key: value for key, value in os.environ.items() if not key.startswith("GIT_")}
    environment["GIT_OPTIONAL_LOCKS"] = "0"
    try:
        answer = subprocess.run(  # noqa: S603 - fixed words
            [program, "-C", str(folder), *words],
            capture_output=True,
            check=False,
            env=environment,
            stdin=subprocess.DEVNULL,
            timeout=_PATIENCE,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return None if answer.returncode else os.fsdecode(answer.stdout).rstrip("\n")


def machine() -> str:
    """
    Describe this machine in one line.

    Examples
    --------
    >>> platform.system() in machine()
    True
    """
    memory = _memory()
    parts = [
        f"{platform.system()} {platform.release()} {platform.machine()}",
        _processor(),
        f"{n_cores()} of {os.cpu_count() or 1} cores",
        f"{memory / 2**30:.1f} GiB" if memory else "",
        f"{platform.python_implementation()} {platform.python_version()}",
    ]
    return ", ".join(part for part in parts if part.strip())


def _processor() -> str:
    """Return the processor's name, as far as the system gives it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    found = re.search(r"^model name\s*:\s*(\S.*)$", text, flags=re.MULTILINE)
    return " ".join(found[1].split()) if found else platform.processor()


def _memory() -> int:
    """Return the size of the memory, bytes; 0 where the system does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 0


def packages() -> dict[str, str]:
    """
    List the versions of Python and of the packages that this one needs, by name.

    Examples
    --------
    >>> sorted({"numpy", "python"} & packages().keys())
    ['numpy', 'python']
    """
    found = {"python": platform.python_version()}
    for requirement in _requirements():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0].lower()
        try:
            found[name] = _version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return dict(sorted(found.items()))


@read_once
def _version(name: str) -> str:
    return importlib.metadata.version(name)


def _requirements() -> list[str]:
    try:
        listed = importlib.metadata.requires("cgla-graph") or []
    except importlib.metadata.PackageNotFoundError:
        # run from a tree that is not installed
        return ["networkx", "numba", "numpy", "ompl", "scipy", "shapely"]
    # packages of tests and extras do not affect results, except graph libraries, which are solvers
    return [one for one in listed if "extra ==" not in one or re.search(r"extra == .graphs.", one)]


def visible(text: str) -> str:
    r"""
    Escape NUL and characters outside UTF-8 (from odd file names).

    Examples
    --------
    >>> print(visible("caf\udce9"))
    caf\udce9
    """
    return text.replace("\0", r"\x00").encode("utf-8", errors="backslashreplace").decode("utf-8")
