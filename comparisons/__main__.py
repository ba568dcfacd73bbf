"""The program `cgla`, also ``python -m cgla_graph.comparisons``: it is ready for Ctrl-C before it imports the rest."""

import os
import sys

from cgla_graph.comparisons import interrupts


def main() -> None:
    """Run the command line, and exit with its status."""
    code: int | str | None = interrupts.INTERRUPTED
    # pydantic, which typer imports, looks for plug-ins of its own in all that is installed: 20 ms for nothing
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    try:
        with interrupts.held():
            from cgla_graph.comparisons.cli.app import main as run  # noqa: PLC0415 - an interrupt of it is caught

            run()
    except SystemExit as left:
        code = left.code
    except BaseException as error:
        if not interrupts.is_interrupt(error):
            raise
        sys.stderr.write("cgla: interrupted\n")
    interrupts.leave_at_once()
    sys.exit(code)


if __name__ == "__main__":
    main()
