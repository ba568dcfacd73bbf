"""Standard output and standard error: results go to the one, progress and words to the other."""

import gc
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import subprocess

    from rich.console import RenderableType

    from cgla_graph.model.cost_model import CostModel


#: Exit statuses: done, a result is missing or a claim does not hold, wrong input, Ctrl-C.
DONE, MISSING, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
#: Width and height of output that goes to no terminal.
PAGE = (160, 50)
#: The message where kernels are missing.
COMPILING = "compiling kernels: once after an installation, for up to a minute"


class ReaderGoneError(Exception):
    """The reader of standard output has gone, as in ``cgla compare | head``."""


class InterruptedRunError(Exception):
    """Ctrl-C ended a comparison; the message says which results are kept."""


#: Program of the second process, which compiles kernels.
_COMPILE = (
    "import sys; sys.path[:] = sys.argv[1].split('\\n'); "
    "from cgla_graph.model.small_problem import MapKind; from cgla_graph.solvers.warm_up import load_last_first; "
    "load_last_first(MapKind(rasters=sys.argv[2] == 'rasters'))"
)


#: The second process, while there is one, and whether it compiles for maps with rasters.
_helpers: "list[tuple[subprocess.Popen[bytes], bool]]" = []


def out(text: str) -> None:
    """
    Write to standard output, at once.

    Raises
    ------
    ReaderGoneError
        If its reader has gone.
    """
    if cast("object", sys.stdout) is None:
        # it was closed before we began, as by ``cgla compare >&-``
        raise ReaderGoneError
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError as error:
        raise ReaderGoneError from error


def out_lines(lines: Mapping[str, str]) -> None:
    """Write a line for each key that has a text (errors as `out`)."""
    out("".join(f"{key:10} {text}\n" for key, text in lines.items() if text))


def out_json(document: Any) -> None:  # noqa: ANN401 - any JSON
    """Write a JSON document to standard output (errors as `out`)."""
    out(json_text(document))


def json_text(document: Any) -> str:  # noqa: ANN401 - any JSON
    """Write a JSON document as text, with a line a value."""
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def out_files(written: Sequence[Path], folder: Path | None = None) -> None:
    """Name the files that were written to a folder, by default that of the first one (errors as `out`)."""
    if written:
        out(f"written to {folder or written[0].parent}: {', '.join(path.name for path in written)}\n")


def out_table(table: "RenderableType") -> None:
    """
    Write a table: as wide as the environment variable COLUMNS says, else as the terminal is, else for a wide page.

    A table that cannot be made that narrow runs over: numbers are not cut (errors as `out`).
    """
    from rich.console import Console  # noqa: PLC0415 - `cgla --help` answers at once

    width, height = shutil.get_terminal_size(PAGE)
    # with both given, rich believes them of any terminal
    console = Console(width=width, height=height)
    with console.capture() as capture:
        console.print(table, crop=False)
    out(capture.get())


def say(text: str) -> None:
    """Write a line to standard error, above any progress."""
    from cgla_graph._progress import say_above  # noqa: PLC0415 - TAB completes at once

    say_above(text)


@contextmanager
def progress(total: int | None) -> Iterator[Callable[[str], None]]:
    """
    Show progress on standard error while it is a terminal; the body calls what it gets after each step.

    If the number of steps is not known beforehand, `total` is None.
    """
    from cgla_graph._progress import showing  # noqa: PLC0415 - `cgla --help` answers at once

    with showing("", total) as tell:
        yield tell


@contextmanager
def running_solvers(model: "CostModel | None" = None) -> Iterator[None]:
    """
    Send what solvers print to standard error, their compiled parts' output as well: standard output is ours.

    That kernels have to be compiled first is said there, too: nothing that is timed waits for it, but the user does.
    No-fly areas and rasters, as `model` has them, have kernels of their own.
    The garbage collector, which the command line leaves off until there is work, is turned on.
    """
    if not gc.isenabled():
        # objects that exist by now stay: the collector need not look through them again
        gc.freeze()
        gc.enable()
    with ExitStack() as stack:
        compile_beside(model)
        stack.callback(end_compiling)
        stack.enter_context(redirect_stdout(sys.stderr))
        with suppress(OSError):
            saved = os.dup(1)
            stack.callback(os.close, saved)
            stack.callback(os.dup2, saved, 1)
            os.dup2(2, 1)
        yield


def compile_beside(model: "CostModel | None" = None) -> None:
    """
    Have a second process compile if kernels are missing, beginning with those that this one comes to last.

    A kernel is compiled by one of them, and the other one finds it on disk. There is never a third process: one that
    compiles for maps without rasters makes way where there are some. It ends with `running_solvers`, or with
    `end_compiling` before.
    """
    import numpy as np  # noqa: PLC0415 - `cgla --help` answers at once

    from cgla_graph._kernel import is_kept  # noqa: PLC0415 - the same
    from cgla_graph.certificate import certificate_kernels, corner_kernels  # noqa: PLC0415 - the same
    from cgla_graph.model import risk_kernels  # noqa: PLC0415 - the same
    from cgla_graph.model.risk import RiskField  # noqa: PLC0415 - the same

    field = RiskField() if model is None else model.field
    walls, rasters = model is not None and not model.area.is_empty, bool(field.rasters)
    ends = np.empty((1, 2))
    segments = ends, ends, field.kernel_field(), np.empty(1)
    are_kept = is_kept(risk_kernels.segment_risks, *segments) and is_kept(certificate_kernels.steepness)
    if (are_kept and (not walls or is_kept(corner_kernels.charge))) or any(of >= rasters for _, of in _helpers):
        return
    import subprocess  # noqa: PLC0415 - rarely used

    if not _helpers:
        say(COMPILING)
    end_compiling()
    folders = "\n".join(sys.path)
    helper = subprocess.Popen(  # noqa: S603 - ours
        [sys.executable, "-c", _COMPILE, folders, "rasters" if rasters else ""],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _helpers.append((helper, rasters))


def end_compiling() -> None:
    """End the second process, if there is one."""
    while _helpers:
        helper, _ = _helpers.pop()
        helper.kill()
        helper.wait()


def forget_stdout() -> None:
    """Point standard output at nothing, so that closing it does not fail at exit."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
