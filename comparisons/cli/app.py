"""Start and end of the command line `cgla`."""

import atexit
import gc
import io
import os
import sys
import warnings
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import completion
from cgla_graph.comparisons.cli.commands import CommandGroup, renamed
from cgla_graph.comparisons.cli.options import option
from cgla_graph.comparisons.interrupts import INTERRUPTED, held, is_interrupt

app = typer.Typer(cls=CommandGroup, rich_markup_mode=None, pretty_exceptions_enable=False)


def _version(asked: bool) -> None:
    """Print the version and exit."""
    if asked:
        from cgla_graph import __version__

        console.out(f"cgla-graph {__version__}\n")
        raise typer.Exit


@app.callback()
def cgla(
    version: Annotated[
        bool, option("--version", "print the version and exit", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Plan over risk maps with every solver, over one and the same cost: length + k * risk."""
    del version
    console.say_compiling()


def _say_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Show a warning as one line on standard error."""
    from cgla_graph._text import remark

    console.say(f"cgla: {remark(message)}")


def _leave_garbage() -> None:
    """Skip the garbage collection at exit, unless OMPL is loaded, which warns of objects that are left."""
    if "ompl" not in sys.modules:
        gc.freeze()


def main() -> None:
    """Run the command line: wrong input is one line on standard error and exit code 2, never a traceback."""
    # imports make hundreds of thousands of objects and no garbage; `console.running_solvers` enables collection
    gc.disable()
    # a collection at the end of the process would take longer than many commands
    atexit.unregister(_leave_garbage)
    atexit.register(_leave_garbage)
    if "_CGLA_COMPLETE" in os.environ:
        completion.read_no_values()
    for stream in (sys.stdout, sys.stderr):
        # a terminal that cannot show a character gets an escape instead of a failure
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with held(), warnings.catch_warnings():
        warnings.showwarning = _say_warning
        code = _run(renamed(sys.argv[1:]) or ["--help"])
    # the process may go on, in tests and if Python calls this
    gc.unfreeze()
    gc.enable()
    sys.exit(code)


def _run(words: list[str]) -> int:
    """Run a command, and return the exit status."""
    from cgla_graph.errors import CglaError

    try:
        code = _called(words)
    except console.InterruptedRunError as error:
        console.say(f"cgla: interrupted: {error}")
        code = INTERRUPTED
    except CglaError as error:
        console.say(f"cgla: {' '.join(str(error).split())}")
        code = console.WRONG_INPUT
    except typer.TyperException as error:
        console.say(f"cgla: {' '.join(error.format_message().split())} (cgla --help shows the usage)")
        code = console.WRONG_INPUT
    except KeyboardInterrupt:
        console.say("cgla: interrupted")
        code = INTERRUPTED
    except console.ReaderGoneError:
        console.forget_stdout()
        code = console.DONE
    except OSError as error:
        console.say(f"cgla: standard output: {error.strerror or error}; choose another place for it")
        console.forget_stdout()
        code = console.WRONG_INPUT
    return int(code or console.DONE)


def _called(words: list[str]) -> int | None:
    """Call a command; an exception that Ctrl-C caused becomes `KeyboardInterrupt`."""
    try:
        code: int | None = app(words, standalone_mode=False)
    except console.InterruptedRunError:
        raise
    except BaseException as error:
        if is_interrupt(error):
            raise KeyboardInterrupt from None
        raise
    # typer turns Ctrl-C into this code
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    return code
