"""The README and the manual are true: nothing that there is goes unmentioned, and what they name is there."""

import dataclasses
import json
import pkgutil
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main
from pages import BLOCKS, EVERY, INDEX, PAGES, ROOT, Block, Page, agrees, calls, put_files

import cgla_graph as cg
from cgla_graph import comparisons
from cgla_graph.comparisons.claims import summary
from cgla_graph.comparisons.cli.app import app
from cgla_graph.comparisons.leaderboard import performance
from cgla_graph.comparisons.missions import files
from cgla_graph.comparisons.study import flight_run, rows
from cgla_graph.comparisons.study.study_file import is_study_file, read_study, study_schema
from cgla_graph.comparisons.tables import certificate, fronts
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import MissionStatus
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.scenarios.mission_file import is_mission_file, load_mission, mission_schema, shipped_missions
from cgla_graph.scenarios.scenario import load_scenario, schema, shipped
from cgla_graph.solvers import registry

ENTRANCE, *MANUAL = EVERY
#: Every word that is set as code, and all text that is none.
CODE = set().union(*(page.code for page in EVERY))
LANGUAGES = {"python", "sh", "toml", "json", "text"}
#: What a newcomer types besides `cgla`, and what of it there has to be.
OTHER_PROGRAMS = {"git", "cd", "source", "make", "pip"}
#: Words that this field says in others.
RIDDLES = re.compile(
    r"\b(dearer|dearest|for ever|forever|lock each other|(no|some|any)body|(who|what|which)ever"
    r"|what (is|was|has|are|were))\b",
    re.IGNORECASE,
)

#: Every command by its words, those of groups too.
COMMANDS: dict[str, Any] = {}
for _name, _command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
    _inner = getattr(_command, "commands", None)
    COMMANDS.update({_name: _command} if _inner is None else {f"{_name} {one}": _inner[one] for one in _inner})


def cgla_calls(blocks: Iterable[Block]) -> Iterator[tuple[str, list[str]]]:
    """Return the calls of `cgla`: where each is, and its words, without what the shell does with its output."""
    for block in blocks:
        for words in calls(block) if block.language == "sh" else []:
            if words[0] == "cgla":
                yield block.place, words[1 : words.index(">") if ">" in words else None]


def test_toml_is_a_file_that_the_toolkit_reads(tmp_path: Path) -> None:
    for block in BLOCKS:
        if block.language != "toml" or block.note("not run") is not None:
            continue
        put_files(block.page, tmp_path)
        name = block.note("file")
        if name is None:
            assert "project" in tomllib.loads(block.text), block.place
            continue
        path = tmp_path / name
        if block.page.name == "uncertain.md" and name != "map.toml":
            cg.read_scenarios(path, load_scenario(tmp_path / "map.toml").problem)
        elif is_study_file(path):
            read_study(path)
        elif is_mission_file(path):
            load_mission(path).missions(registry.get)
        else:
            load_scenario(path)


def test_what_a_page_states_is_held_against_what_is_printed() -> None:
    """Times, the widths that follow from them and last digits may differ; dots stand for anything."""
    printed = "cost 1.4900001 of 1,024\n━━━━━\ntook 12.5 ms\nwritten\n"
    for stated in ("cost 1.49 of 1,024\n━━\ntook 1 s\nwritten\n", "cost 1.49\n…\n", "…written\n", "…of 1,024…"):
        assert agrees(stated, printed)
    for stated in ("cost 1.48\n…\n", "cost 1.49\n", "", "…\nwrote\n", "…of 1,025…", "…of N…"):
        assert not agrees(stated, printed)


def test_blocks_have_a_language_and_notes_that_are_known() -> None:
    for block in BLOCKS:
        assert block.language in LANGUAGES, block.place
        assert {note.split(":")[0] for note in block.notes} <= {"file", "slow", "not run"}, block.place
        if block.language == "json":
            json.loads(block.text)


def test_code_of_the_manual_fits_the_site() -> None:
    """88 columns are 700 pixels there; outputs and files of data may scroll."""
    for block in BLOCKS:
        if block.page not in {PAGES[0], ROOT / "docs" / "claims.md"} and block.language in {"python", "sh"}:
            assert max(map(len, block.text.splitlines())) <= 88, f"{block.place}: over 88 columns"


def test_commands_are_real() -> None:
    """Every command exists and has the options that a page gives it; scenarios are shipped, or files."""
    known = {*shipped(), *shipped_missions()}
    for place, words in cgla_calls(BLOCKS):
        if words[0] in {"--help", "--version"}:
            continue
        n_words = 1 if words[0] in COMMANDS else 2
        name, rest = " ".join(words[:n_words]), words[n_words:]
        assert name in COMMANDS, place
        given = COMMANDS[name].make_context(name, rest, resilient_parsing="--help" in rest).params
        named = [given.get(name) or () for name in ("scenario", "mission", "scenarios")]
        for spec in (spec for part in named for spec in ([part] if isinstance(part, str) else part)):
            is_file = re.search(r"\.(toml|geojson|json|kml|kmz|map|scen|csv|asc|tif|npy)(:[\d-]+)?$", spec)
            assert spec in known or is_file, place


def test_other_programs_find_what_they_are_told() -> None:
    """Make has the targets, the package the extras that pages name."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = {target for line in re.findall(r"^([\w ]+):(?!=)", makefile, re.MULTILINE) for target in line.split()}
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for block in BLOCKS:
        for program, *rest in calls(block) if block.language == "sh" else []:
            assert program == "cgla" or program in OTHER_PROGRAMS, block.place
            if program == "make":
                assert targets.issuperset(rest), block.place
            if program == "pip":
                assert {extra for word in rest for extra in re.findall(r"\[(\w+)\]", word)} <= extras.keys(), (
                    block.place
                )
    assert targets.issuperset(re.findall(r"`make (\w+)`", " ".join(page.prose for page in EVERY)))


def test_the_readme_is_an_entrance() -> None:
    lines = ENTRANCE.text.splitlines()
    assert len(lines) <= 150
    assert any(line.startswith("![") for line in lines[:10])
    first, *_ = (block.text for block in ENTRANCE.blocks if block.language == "python")
    assert len([line for line in first.splitlines() if line.strip()]) <= 10
    for heading in ("install", "limits", "tests"):
        assert heading in ENTRANCE.anchors
    for target in ("make test", "make check", "make fuzz"):
        assert re.search(rf"`{target}`.*\bmin\b", ENTRANCE.text), f"how long does {target} take?"


def test_links_and_pictures_are_there() -> None:
    for page, link in ((one, link) for one in EVERY for link in one.links):
        if link.startswith(("http://", "https://")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.path.parent / name).resolve() if name else page.path
        if target.parent == INDEX.parent / "generated" / "sections":
            # (made of the index's sections when the site is built)
            assert target.stem in Page(INDEX).anchors, f"{page.path.name}: {link}"
            continue
        assert target.is_file(), f"{page.path.name}: {link}"
        assert not anchor or anchor in Page(target).anchors, f"{page.path.name}: {link}"


def test_every_page_is_linked_from_the_index() -> None:
    """The tables of the index are the site's tree of contents as well; the site has a first page of its own."""
    linked = {(INDEX.parent / link.partition("#")[0]).resolve() for link in Page(INDEX).links}
    assert {*PAGES} - {INDEX, INDEX.with_name("index.md")} <= linked
    assert INDEX in {(ROOT / link.partition("#")[0]).resolve() for link in ENTRANCE.links}


def test_every_picture_is_shown() -> None:
    shown = {(page.path.parent / link).resolve() for page in EVERY for link in page.links}
    assert {*(ROOT / "comparisons" / "pictures").iterdir()} <= shown


def test_pages_say_it_in_the_words_of_the_field() -> None:
    # the entrance and the page of claims hold quotations of the paper
    for page in MANUAL:
        prose = re.sub(r"<!-- answers.*<!-- end of answers -->", "", page.prose, flags=re.DOTALL)
        assert not RIDDLES.search(prose), page.path


def test_every_command_and_option_is_told() -> None:
    options = {
        option for command in COMMANDS.values() for one in command.params for option in (*one.opts, *one.secondary_opts)
    }
    text = next(page for page in MANUAL if page.path.name == "command-line.md").text
    for option in options:
        assert not option.startswith("--") or re.search(rf"{option}\b", text), option
    for name in COMMANDS:
        assert f"`cgla {name}`" in text


def test_every_solver_and_its_settings_are_told() -> None:
    """Settings stand in a row with the solver's name, each with its default."""
    text = next(page for page in MANUAL if page.path.name == "solvers.md").text
    rows = [line for line in text.partition("## Settings")[2].splitlines() if line.startswith("| `")]
    for name in registry.names(installed=False):
        (row,) = (line for line in rows if f"`{name}`" in line.split("|")[1])
        for setting in dataclasses.fields(registry.solver_class(name)):  # type: ignore[arg-type]
            assert re.search(rf"`{setting.name}` {re.escape(str(setting.default))}(,| \|)", row), (name, setting.name)


def keys_of(table: dict[str, Any]) -> set[str]:
    """Return the keys that a JSON schema knows, those of tables in it among them."""
    found = set(table.get("properties", {}))
    return found.union(*(keys_of(part) for part in table.get("$defs", {}).values()))


@pytest.mark.parametrize(
    "names",
    [
        pytest.param([*shipped(), *shipped_missions()], id="what is shipped"),
        pytest.param([*(one.label for one in cg.Status), *(one.label for one in MissionStatus)], id="statuses"),
        pytest.param([*cg.__all__, *comparisons.__all__], id="public names"),
        pytest.param(keys_of(schema()) | keys_of(mission_schema()) | keys_of(study_schema()), id="keys of files"),
        pytest.param(
            [one.name for kind in (Mission, Uav, Sharing, VirtualObstacle) for one in dataclasses.fields(kind)],
            id="settings of missions",
        ),
        pytest.param([one.key for one in rows.EXPORTED], id="columns of runs"),
        pytest.param([*flight_run.COLUMNS, *files.TRACE_COLUMNS], id="columns of flights"),
        pytest.param(
            [*certificate.COLUMNS, *fronts.COLUMNS, *fronts.PROVEN_COLUMNS, *fronts.BUDGET_COLUMNS],
            id="columns of proofs and fronts",
        ),
        pytest.param(
            [re.sub("_(low|high)$", "", one) for one in performance.PERFORMANCE_COLUMNS], id="columns of summaries"
        ),
    ],
)
def test_nothing_goes_unmentioned(names: Iterable[str]) -> None:
    # what a constructor takes as another word, or works out by itself
    hidden = {"world", "uavs", "solver", "is_on"}
    missing = {name for name in names if name not in CODE and not any(word.endswith(f".{name}") for word in CODE)}
    assert missing <= hidden


def test_what_pages_name_can_be_imported() -> None:
    named = {
        re.sub(r"^cg\b", "cgla_graph", word) for word in CODE if re.match(r"(cg|cgla_graph|comparisons)\.\w", word)
    }
    for name in named:
        # of functions, some have the old names of modules
        if not name.endswith((".png", ".toml")) and not hasattr(cg, name.removeprefix("cgla_graph.")):
            pkgutil.resolve_name(re.sub(r"^comparisons\b", "cgla_graph.comparisons", name))


def test_pages_show_the_answers_that_are_shipped() -> None:
    for path in (ROOT / "README.md", ROOT / "docs" / "claims.md"):
        text = path.read_text(encoding="utf-8")
        assert summary.with_answers(text, summary.shipped_verdicts()) == text, f"{path.name}: run make claims"
