"""The README is true: its Python runs, its commands and solvers exist."""

import re
import shlex
from pathlib import Path

import pytest

from cgla_graph.comparisons.study.limits import Limits
from cgla_graph.comparisons.study.study_file import study_from_toml
from cgla_graph.mission_file import shipped_missions
from cgla_graph.scenario import shipped
from cgla_graph.solvers import registry

README = (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """All code blocks of one language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def test_the_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """One block after the other, in one namespace, as a reader would type them."""
    space: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, "README.md", "exec"), space)  # noqa: S102 - our own text
    assert "optimal" in capsys.readouterr().out


def test_the_api_fits_in_twenty_lines() -> None:
    lines = [line for line in blocks("python")[0].splitlines() if line.strip()]
    assert len(lines) <= 20


def test_every_solver_is_in_the_readme() -> None:
    for name in registry.names(installed=False):
        assert f"`{name}`" in README


def test_the_commands_of_the_readme_name_real_options(capsys: pytest.CaptureFixture[str]) -> None:
    """Every subcommand exists, has the options that the README gives it, and scenarios are shipped or made by it."""
    import typer.main  # noqa: PLC0415 - only here

    from cgla_graph.comparisons.cli import app  # noqa: PLC0415 - only here

    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    lines = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("cgla ")]
    assert len(lines) >= 6
    for line in lines:
        _, name, *rest = shlex.split(line, comments=True)
        options = {option for parameter in commands[name].params for option in parameter.opts}
        assert {word for word in rest if word.startswith("--")} <= options
        if name in {"compare", "plan", "fly"} and rest and not rest[0].startswith("--"):
            missions = [] if name == "plan" else shipped_missions()
            known = missions if name == "fly" else [*shipped(), *missions, "mine.toml", "study.toml"]
            assert rest[0] in known


def test_the_study_of_the_readme_is_one() -> None:
    (text,) = (block for block in blocks("toml") if "scenarios" in block)
    study = study_from_toml(text)
    assert len(list(study.cells())) > 100
    assert study.limits == Limits(60.0, 2048.0)
