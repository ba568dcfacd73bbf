"""
Progress of long computations: one line on a terminal or in a notebook after a second, and nothing elsewhere.

A thread of its own draws the line, since the slow step is not known beforehand. It ends with the ``with`` block.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import copy_context
from functools import partial
from io import StringIO
from typing import TYPE_CHECKING, Any, Protocol, TextIO, TypeVar, cast

from cgla_graph._text import printable, shown
from cgla_graph.errors import ProgressError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

T = TypeVar("T")

#: Seconds before the line is shown, and between updates.
QUIET, EVERY = 1.0, 0.25
#: Width of the line in a notebook, characters.
NOTEBOOK_WIDTH = 100


class Tell(Protocol):
    """A function that a computation calls to report progress."""

    def __call__(self, text: str, done: float | None = None) -> None:
        """Take the state and the number of steps that are done; None: one more."""


def progress(on: bool) -> None:
    """
    Turn the progress line of long computations on or off; it is on by default.

    A computation of more than a second has one line on standard error if that is a terminal, or under the cell of a
    notebook; the line is removed at the end. Elsewhere there is no line.

    Parameters
    ----------
    on
        Whether to show the line from now on, in this process.

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
    """The switch, the line and the terminal that it is drawn on: one of each in a process."""

    on = True
    line: "_Line | None" = None
    console: "Console | None" = None
    #: In a worker: passes its progress to the program that waits for it.
    relay: Callable[[str, str], None] | None = None
    #: Called before kernels are compiled; None after the first call.
    when_compiling: Callable[[], None] | None = None
    #: Number of kernels that are being compiled, here or in processes that this one waits for.
    n_compiling = 0


@contextmanager
def showing(what: str, total: int | None = None, *, done: int = 0, began: float | None = None) -> Iterator[Tell]:
    """
    Show the progress of the body if it takes longer than a second; a block inside another one adds to its line.

    Only the main thread shows anything.

    Parameters
    ----------
    what
        Name of the work.
    total
        Steps that it takes; None if that is not known.
    done
        Steps that are done already.
    began
        When it began (`time.monotonic`); None: now.

    Yields
    ------
    tell
        Function that the body calls to report progress.

    Examples
    --------
    >>> with showing("counting", total=2) as tell:
    ...     tell("one")
    ...     tell("two")
    """
    outer = _State.line
    if threading.current_thread() is not threading.main_thread():
        yield _ignore
    elif (relayed := _State.relay) is not None:
        yield lambda text, done=None: relayed(what, text)  # noqa: ARG005 - steps are not relayed
    elif outer is not None:
        before = outer.inner
        try:
            outer.inner = what
            yield partial(outer.tell_inside, what)
        finally:
            outer.inner = before
    elif not _is_watched():
        yield _ignore
    else:
        line = _Line(what, total, done, time.monotonic() if began is None else began)
        try:
            _State.line = line
            line.start()
            yield line.tell
        finally:
            _State.line = None
            line.over.set()
            line.join()


def waiting(what: str, results: Iterable[T], total: int | None = None) -> Iterator[T]:
    """
    Yield results, and show their number while waiting for the next one; there is no line while a result is used.

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
    """Pass progress to another process from now on: `say` takes the work and its state."""
    _State.relay = say


def tell_inside(what: str, text: str) -> None:
    """Show the progress of a worker that this process waits for."""
    if _State.line is not None and threading.current_thread() is threading.main_thread():
        _State.line.tell_inside(what, text)


def when_compiling(say: Callable[[], None]) -> None:
    """Have a function called once, before the first kernel is compiled that is not on disk."""
    _State.when_compiling = say


def compiling() -> None:
    """Call the function of `when_compiling`: a kernel is going to be compiled, here or in another process."""
    say, _State.when_compiling = _State.when_compiling, None
    if say is not None:
        say()


@contextmanager
def while_compiling() -> Iterator[None]:
    """Count a kernel as being compiled during the body."""
    compiling()
    _State.n_compiling += 1
    try:
        yield
    finally:
        _State.n_compiling -= 1


def say_above(text: str) -> None:
    """Write a line to standard error, above any progress."""
    console = _State.console
    if console is None:
        sys.stderr.write(f"{text}\n")
    else:
        console.print(text, markup=False, highlight=False, soft_wrap=True)


def _ignore(text: str, done: float | None = None) -> None:
    """Show nothing."""


def _is_notebook() -> bool:
    return "IPython" in sys.modules and hasattr(cast("Any", sys.modules["IPython"]).get_ipython(), "kernel")


def _is_watched() -> bool:
    """Return whether a user may see the line; a child process leaves the line to its parent."""
    known = sys.modules.get("multiprocessing.process")
    if not _State.on or (known is not None and cast("Any", known).parent_process() is not None):
        return False
    # a stream may be missing or closed
    with suppress(ValueError, AttributeError):
        return _is_notebook() or sys.stderr.isatty()
    return False


class _Line(threading.Thread):
    """The state of a computation, and the thread that draws it."""

    def __init__(self, what: str, total: int | None, done: float, began: float) -> None:
        super().__init__(name="cgla-progress", daemon=True)
        self.what, self.total, self.done, self.began = what, total, done, began
        self.at = self.inner = ""
        self.over = threading.Event()
        # (the context tells a notebook which cell to write to)
        self.context = copy_context()

    def tell(self, text: str, done: float | None = None) -> None:
        """Take the state of the computation; None: one more step is done."""
        self.at, self.done = text, self.done + 1 if done is None else done

    def tell_inside(self, what: str, text: str, done: float | None = None) -> None:
        """Take the state of a computation inside this one."""
        del done
        self.inner = f"{what}: {text}"

    def text(self) -> str:
        """Return the whole state in one line."""
        doing = "compiling kernels, once after an installation" if _State.n_compiling else self.inner
        return " ".join(printable(": ".join(filter(None, (self.what, self.at, doing)))).split())

    def run(self) -> None:
        """Draw the line until the computation is over, and remove it."""
        if not self.over.wait(max(self.began + QUIET - time.monotonic(), 0.0)):
            # a terminal may have gone
            with suppress(OSError, ValueError):
                self.context.run(self._in_notebook if _is_notebook() else self._on_terminal)

    def _bar(self, file: TextIO, width: int | None = None) -> "Progress":
        from rich.console import Console  # noqa: PLC0415 - rich takes a tenth of a second, and few need it
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415
        from rich.table import Column  # noqa: PLC0415

        console = Console(file=file, width=width, force_jupyter=False)
        counted = () if self.total is None else (MofNCompleteColumn(),)
        text = TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True, overflow="ellipsis"))
        columns = (BarColumn(bar_width=20), *counted, TimeElapsedColumn(), text)
        # (rich's redirection would interfere with that of solvers' output inside)
        plain = {"redirect_stdout": False, "redirect_stderr": False}
        bar = Progress(*columns, console=console, transient=True, auto_refresh=False, get_time=time.monotonic, **plain)
        bar.add_task(self.text(), total=self.total, completed=int(self.done))
        bar.tasks[0].start_time = self.began
        return bar

    def _steps(self, bar: "Progress") -> Iterator[None]:
        """Update the bar repeatedly until the computation is over."""
        while True:
            bar.update(bar.task_ids[0], completed=self.done, description=self.text())
            yield
            if self.over.wait(EVERY):
                return

    def _on_terminal(self) -> None:
        bar = self._bar(sys.stderr)
        if bar.console.is_dumb_terminal:
            return
        with bar:
            _State.console = bar.console
            try:
                for _ in self._steps(bar):
                    bar.refresh()
            finally:
                _State.console = None

    def _in_notebook(self) -> None:
        """Draw under the cell that runs; no widgets are needed."""
        bar = self._bar(StringIO(), NOTEBOOK_WIDTH)
        handle = cast("Any", sys.modules["IPython"]).display.display({"text/plain": ""}, raw=True, display_id=True)
        try:
            for _ in self._steps(bar):
                with bar.console.capture() as captured:
                    bar.console.print(bar.get_renderable())
                handle.update({"text/plain": captured.get().strip("\n")}, raw=True)
        finally:
            handle.update({"text/plain": ""}, raw=True)
