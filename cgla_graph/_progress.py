"""
How far a long computation is: one line on a terminal or in a notebook after a second, and nothing elsewhere.

The line is drawn by a thread, since nobody knows beforehand which step takes long, and that thread ends with the `with`
block that it was started by. It is only started where there is somebody to look.
"""

import io
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from contextvars import copy_context
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, TextIO, TypeVar, cast

from cgla_graph._text import shown
from cgla_graph.errors import ProgressError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

T = TypeVar("T")

#: Nothing is shown before this, and then so often, in seconds.
QUIET, EVERY = 1.0, 0.25
#: Width of the line in a notebook, characters.
NOTEBOOK_WIDTH = 100
#: What empties the last line of a terminal.
CLEAR = "\r\x1b[2K"


class Tell(Protocol):
    """What a computation calls when it has come further."""

    def __call__(self, text: str, done: float | None = None) -> None:
        """Say what it is at, and how many of its steps are done; None: one more."""


def progress(on: bool) -> None:
    """
    Show how far long computations are, or do not: on from the start.

    What takes longer than a second is shown as one line on standard error while that is a terminal, and under the cell
    of a notebook; it goes away at the end. Elsewhere, nothing is ever shown.

    Parameters
    ----------
    on
        Whether to show it from now on, in this process.

    Raises
    ------
    ProgressError
        If `on` is neither True nor False.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> cg.progress(False)
    >>> cg.progress(True)
    """
    if not isinstance(cast("object", on), bool):
        msg = f"on is {shown(on)}; give True to show progress, False to show none"
        raise ProgressError(msg)
    _State.on = on


class _State:
    """What there is one of in a process."""

    on = True
    line: "_Line | None" = None
    #: The terminal whose last line is taken.
    drawn_on: TextIO | None = None
    #: In a worker: tells the program that waits for it what is being done.
    relay: Callable[[str, str], None] | None = None


@contextmanager
def showing(what: str, total: int | None = None, *, done: int = 0, began: float | None = None) -> Iterator[Tell]:
    """
    Show how far the body is, should it take longer than a second; inside of another one, that one shows it.

    Only the main thread shows anything: others work for somebody who is not looking here.

    Parameters
    ----------
    what
        What the body does.
    total
        Steps that it takes; None if nobody knows.
    done
        Steps that are done already.
    began
        When it began (`time.monotonic`); None: now.

    Yields
    ------
    tell
        What the body calls when it has come further.

    Examples
    --------
    >>> with showing("counting", total=2) as tell:
    ...     tell("one")
    ...     tell("two")
    """
    outer = _State.line
    if threading.current_thread() is not threading.main_thread():
        yield _tell_nobody
    elif _State.relay is not None:
        yield partial(_relayed, _State.relay, what)
    elif outer is not None:
        before = outer.inner
        try:
            outer.inner = what
            yield partial(outer.tell_inside, what)
        finally:
            outer.inner = before
    elif (place := _place()) is None:
        yield _tell_nobody
    else:
        line = _Line(what, total, done, time.monotonic() if began is None else began)
        over = threading.Event()
        # (a notebook knows by its context which cell to write to)
        run = partial(copy_context().run, line.draw, place, over)
        thread = threading.Thread(target=run, name="cgla-progress", daemon=True)
        try:
            _State.line = line
            thread.start()
            yield line.tell
        finally:
            _State.line = None
            over.set()
            thread.join()


def waiting(what: str, results: Iterable[T], total: int | None = None) -> Iterator[T]:
    """
    Yield results, and show how many there are while the next one is waited for: the line is gone while it is used.

    Examples
    --------
    >>> list(waiting("counting", range(3), total=3))
    [0, 1, 2]
    """
    began, coming = time.monotonic(), enumerate(results)
    done = 0
    while True:
        with showing(what, total, done=done, began=began):
            number, result = next(coming, (None, None))
        if number is None:
            return
        yield cast("T", result)
        done = number + 1


def relay(say: Callable[[str, str], None]) -> None:
    """Have progress shown by another process from now on, which is told what is done and how far it is."""
    _State.relay = say


def tell_inside(what: str, text: str) -> None:
    """Show the progress of a worker that this process waits for."""
    if _State.line is not None and threading.current_thread() is threading.main_thread():
        _State.line.tell_inside(what, text)


def _relayed(say: Callable[[str, str], None], what: str, text: str, done: float | None = None) -> None:
    del done
    say(what, text)


def wipe() -> None:
    """Make room on standard error for a line of words; progress goes on below it."""
    if _State.drawn_on is not None:
        _State.drawn_on.write(CLEAR)


def _tell_nobody(text: str, done: float | None = None) -> None:
    """Say nothing."""


#: Shows a line of progress, again and again.
_Show = Callable[["Progress"], None]
_Place = Callable[[], AbstractContextManager[_Show | None]]


def _place() -> _Place | None:
    """Return where somebody looks, if anybody does."""
    if not _State.on:
        return None
    if "IPython" in sys.modules and hasattr(cast("Any", sys.modules["IPython"]).get_ipython(), "kernel"):
        return _in_notebook
    stream = cast("TextIO | None", sys.stderr)
    # it may be closed
    with suppress(ValueError, AttributeError):
        if stream is not None and stream.isatty():
            return partial(_on_terminal, stream)
    return None


def _is_compiling() -> bool:
    """Whether kernels are being compiled; what would tell is slow to import, and has been where there are kernels."""
    known = sys.modules.get("cgla_graph._kernel")
    return known is not None and bool(cast("Any", known).is_compiling())


class _Line:
    """What is known of a computation: written by it, and read by the thread that draws."""

    def __init__(self, what: str, total: int | None, done: float, began: float) -> None:
        self.what, self.total, self.done, self.began = what, total, done, began
        self.at = self.inner = ""

    def tell(self, text: str, done: float | None = None) -> None:
        """Take what the computation says."""
        self.at, self.done = text, self.done + 1 if done is None else done

    def tell_inside(self, what: str, text: str, done: float | None = None) -> None:
        """Take what a computation says that this one is waiting for."""
        del done
        self.inner = f"{what}: {text}"

    def text(self) -> str:
        """Say all of it in one line."""
        doing = "compiling kernels, once after an installation" if _is_compiling() else self.inner
        return ": ".join(filter(None, (self.what, self.at, doing)))

    def draw(self, place: _Place, over: threading.Event) -> None:
        """Draw the line until it is over, and take it away."""
        if over.wait(max(self.began + QUIET - time.monotonic(), 0.0)):
            return
        # a terminal may have gone
        with suppress(OSError, ValueError), place() as show:
            if show is None:
                return
            bar = _bar(self.total, self.began)
            while True:
                bar.update(bar.task_ids[0], completed=self.done, description=self.text())
                show(bar)
                if over.wait(EVERY):
                    break


def _bar(total: int | None, began: float) -> "Progress":
    """Return the bar, with what it says beside it; of how many steps, where that is known."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415
    from rich.table import Column  # noqa: PLC0415 - rich takes a tenth of a second, and most never need it

    counted = () if total is None else (MofNCompleteColumn(),)
    said = TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True, overflow="ellipsis"))
    bar = Progress(BarColumn(bar_width=20), *counted, TimeElapsedColumn(), said, get_time=time.monotonic)
    bar.add_task("", total=total)
    bar.tasks[0].start_time = began
    return bar


def _line_of(bar: "Progress", console: "Console") -> str:
    with console.capture() as captured:
        console.print(bar.get_renderable(), width=console.width - 1, no_wrap=True, overflow="ellipsis")
    return captured.get().strip("\n")


@contextmanager
def _on_terminal(stream: TextIO) -> Iterator[_Show | None]:
    """Draw over the last line of a terminal, and leave it empty; on one that cannot do that, draw nothing."""
    from rich.console import Console  # noqa: PLC0415 - the same

    console = Console(file=stream)
    if console.is_dumb_terminal or console.legacy_windows or not console.is_terminal:
        yield None
        return

    def write(text: str) -> None:
        stream.write(f"{CLEAR}{text}")
        stream.flush()

    try:
        _State.drawn_on = stream
        yield lambda bar: write(_line_of(bar, console))
    finally:
        _State.drawn_on = None
        write("")


@contextmanager
def _in_notebook() -> Iterator[_Show | None]:
    """Draw under the cell that runs, and leave that empty; no widgets are needed."""
    display = cast("Any", sys.modules["IPython"]).display.display
    from rich.console import Console  # noqa: PLC0415 - the same

    console = Console(file=io.StringIO(), width=NOTEBOOK_WIDTH, force_terminal=False, force_jupyter=False)
    handle = display({"text/plain": ""}, raw=True, display_id=True)
    try:
        yield lambda bar: handle.update({"text/plain": _line_of(bar, console)}, raw=True)
    finally:
        handle.update({"text/plain": ""}, raw=True)
