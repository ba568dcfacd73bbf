"""Standard output and standard error: results go to the one, progress and words to the other."""

import gc
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from cgla_graph.model.cost_model import CostModel


#: Exit statuses: done, a result is missing or a claim does not hold, wrong input (Ctrl-C: `interrupts.INTERRUPTED`).
DONE, MISSING, WRONG_INPUT = 0, 1, 2
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
    "from cgla_graph.model.cost_model import MapKind; from cgla_graph.solvers.warm_up import load_last_first; "
    "load_last_first(MapKind(walls='walls' in sys.argv, rasters='rasters' in sys.argv))"
)
#: Seconds to wait for it at the end of a command.
LONGEST_WAIT = 300.0


def out(text: str) -> None:
    """
    Write to standard output, at once; characters that would steer a terminal are escaped.

    Raises
    ------
    ReaderGoneError
        If its reader has gone.
    """
    from cgla_graph._text import printable  # noqa: PLC0415 - TAB completes at once

    _write(printable(text))


def _write(text: str) -> None:
    """Write to standard output as it is (errors as `out`)."""
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
    out("".join(f"{key:10} {' '.join(text.splitlines())}\n" for key, text in lines.items() if text))


def out_json(document: Any) -> None:  # noqa: ANN401 - any JSON
    """Write a JSON document to standard output (errors as `out`)."""
    out(json_text(document))


def json_text(document: Any) -> str:  # noqa: ANN401 - any JSON
    """Write a JSON document as text, with a line a value; what would steer a terminal is escaped as JSON has it."""
    from cgla_graph._text import escaped_in_json  # noqa: PLC0415 - TAB completes at once

    return escaped_in_json(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)) + "\n"


def out_files(written: Sequence[Path], folder: Path | None = None) -> None:
    """Name the files that were written, in a line for each folder; all are in `folder` if given (errors as `out`)."""
    names: dict[Path, list[str]] = {}
    for path in written:
        names.setdefault(folder or path.parent, []).append(" ".join(path.name.splitlines()))
    for place, inside in names.items():
        out(f"written to {place}: {', '.join(inside)}\n")


def out_table(table: "RenderableType") -> None:
    """
    Write a table: as wide as the environment variable COLUMNS says, else as the terminal is, else for a wide page.

    A table that cannot be made that narrow runs over: numbers are not cut (errors as `out`).
    """
    from rich.console import Console  # noqa: PLC0415 - `cgla --help` answers at once
    from rich.segment import Segment, Segments  # noqa: PLC0415 - the same

    from cgla_graph._text import printable  # noqa: PLC0415 - the same

    width, height = shutil.get_terminal_size(PAGE)
    # with both given, rich believes them of any terminal
    console = Console(width=width, height=height)
    # (colours are added to the printable text)
    parts = [Segment(printable(part.text), part.style) for part in console.render(table)]
    with console.capture() as capture:
        console.print(Segments(parts), crop=False, end="")
    _write(capture.get())


def listing(
    title: str, heads: Sequence[str], lines: Iterable[Mapping[str, Any]], widest: Mapping[str, int] | None = None
) -> "Table":
    """
    Show records as a plain table, one column for each head; the first, names to be typed, is not folded.

    Columns in `widest` are at most so wide.
    """
    from rich.table import Table  # noqa: PLC0415 - `cgla --help` answers at once
    from rich.text import Text  # noqa: PLC0415 - the same

    table = Table(title=title, title_justify="left", title_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, overflow="fold", no_wrap=number == 0, max_width=(widest or {}).get(head))
    for line in lines:
        table.add_row(*(Text(str(line[head])) for head in heads))
    return table


def say(text: str) -> None:
    """Write a line to standard error, above any progress."""
    from cgla_graph._progress import say_above  # noqa: PLC0415 - TAB completes at once
    from cgla_graph._text import printable  # noqa: PLC0415 - the same

    say_above(printable(text))


@contextmanager
def progress(total: int | None) -> Iterator[Callable[[str], None]]:
    """
    Show progress on standard error while it is a terminal; the body calls what it gets after each step.

    If the number of steps is not known beforehand, `total` is None.
    """
    from cgla_graph._progress import showing  # noqa: PLC0415 - `cgla --help` answers at once

    with showing("", total) as tell:
        yield tell


def say_compiling() -> None:
    """Write to standard error, once, that kernels are compiled, when the first one is that is not on disk."""
    from cgla_graph._progress import when_compiling  # noqa: PLC0415 - TAB completes at once

    when_compiling(lambda: say(COMPILING))


@contextmanager
def running_solvers(proving_on: "Sequence[CostModel]" = ()) -> Iterator[None]:
    """
    Send what solvers print to standard error, their compiled parts' output as well: standard output is ours.

    If kernels are missing that bounds on maps with these models need, a second process compiles about half of them.
    The garbage collector, which the command line leaves off until there is work, is turned on.
    """
    if not gc.isenabled():
        # objects that exist by now stay: the collector need not look through them again
        gc.freeze()
        gc.enable()
    with ExitStack() as stack:
        if proving_on:
            stack.enter_context(_compiling_beside(proving_on))
        stack.enter_context(redirect_stdout(sys.stderr))
        with suppress(OSError):
            saved = os.dup(1)
            stack.callback(os.close, saved)
            stack.callback(os.dup2, saved, 1)
            os.dup2(2, 1)
        yield


@contextmanager
def _compiling_beside(models: "Sequence[CostModel]") -> Iterator[None]:
    """
    Have a second process compile if kernels of proofs are missing, beginning with those that this one comes to last.

    A kernel is compiled by one of them, and the other one finds it on disk. The second process is waited for, so that
    no kernel is missing the next time; only Ctrl-C ends it early.
    """
    import numpy as np  # noqa: PLC0415 - `cgla --help` answers at once

    from cgla_graph._kernel import is_kept  # noqa: PLC0415 - the same
    from cgla_graph._progress import compiling  # noqa: PLC0415 - the same
    from cgla_graph.certificate import certificate_kernels, corner_kernels  # noqa: PLC0415 - the same
    from cgla_graph.model import risk_kernels  # noqa: PLC0415 - the same

    ends = np.empty((1, 2))
    walls = any(not model.area.is_empty for model in models)
    of_field = next((model.field for model in models if model.field.rasters), models[0].field)
    are_kept = is_kept(risk_kernels.segment_risks, ends, ends, of_field.kernel_field(mixed=True), np.empty(1))
    if are_kept and is_kept(certificate_kernels.steepness) and (not walls or is_kept(corner_kernels.charge)):
        yield
        return
    import subprocess  # noqa: PLC0415 - rarely used

    compiling()
    kind = ["walls"] * walls + ["rasters"] * bool(of_field.rasters)
    helper = subprocess.Popen(  # noqa: S603 - ours
        [sys.executable, "-c", _COMPILE, "\n".join(sys.path), *kind],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    except KeyboardInterrupt:
        helper.kill()
        raise
    finally:
        try:
            helper.wait(LONGEST_WAIT)
        except BaseException as error:
            helper.kill()
            if not isinstance(error, subprocess.TimeoutExpired):
                raise


def forget_stdout() -> None:
    """Point standard output at nothing, so that closing it does not fail at exit."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
