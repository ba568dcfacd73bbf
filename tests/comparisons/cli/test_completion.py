"""Completion of names in a shell without heavy imports, and the script for the shell."""

import os
import subprocess
import sys

import pytest


def completed(words: str) -> list[str]:
    """Complete the last word as bash does."""
    count = len(words.split(" ")) - 1
    environment = os.environ | {"_CGLA_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(count)}
    code = (
        "import sys; sys.argv = ['cgla']\n"
        "from cgla_graph.comparisons.cli.app import main\n"
        "try:\n    main()\n"
        "finally:\n"
        "    heavy = {'numpy', 'numba', 'scipy', 'rich', 'tomllib', 'pydantic'}\n"
        "    print(*(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stderr.split() == []  # nothing heavy was imported
    return done.stdout.split()


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("cgla plan pap", ["paper"]),
        ("cgla fly swar", ["swarm"]),
        ("cgla compare swar", ["swarm"]),
        ("cgla compare paper --solvers cgla,dij", ["cgla,dijkstra"]),
        ("cgla plan paper --solver fast-mar", ["fast-marching"]),
        ("cgla par", ["pareto"]),
        ("cgla graph che", ["check"]),
    ],
)
def test_names_are_completed(words: str, names: list[str]) -> None:
    assert completed(words) == names


def test_the_script_for_a_shell_is_printed() -> None:
    environment = os.environ | {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "cgla_graph.comparisons", "--show-completion", "bash"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0
    assert "complete -o default" in done.stdout
