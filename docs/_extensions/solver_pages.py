"""A page for each solver, made from the registry: promises, settings, a picture, and when to use it."""

import dataclasses
import tomllib
from pathlib import Path

import solver_pictures
from generated import write
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.typing import ExtensionMetadata

import cgla_graph as cg
from cgla_graph.model.solver import Traits
from cgla_graph.solvers import registry

FOLDER = "generated/solvers"
#: In which chapter a solver is, by the package of its module.
CHAPTERS = {
    "exact": "Exact, on a graph",
    "continuous": "In the plane",
    "refine": "In the plane",
    "grid": "On a lattice or on cells",
    "sampling": "By random samples",
    "geometric": "By geometry, programs and evolution",
    "reactive": "Step by step",
}
#: What each trait promises, in a sentence for each of its values.
PROMISES = {
    "exact": ("The path has least cost on its graph.", ""),
    "anytime": ("Records its best cost over time.", ""),
    "seeded": ("Draws random numbers; the same seed gives the same path.", "Draws no random numbers."),
    "no_fly": ("Plans around no-fly areas.", "Is blind to no-fly areas: its path may be infeasible."),
    "complete": ("Can be expected to find a path where there is one.", "May get stuck, and says how."),
    "needs_positive": ("Needs weights of at least 0, and peaks of at most 1.", ""),
    "lazy": ("Weighs only the pairs that it needs: lattices of any size.", ""),
    "isolated": ("Runs in a worker process, as compiled code of others may crash.", ""),
    "rasters": ("Takes risk on rasters.", "Does not see risk on rasters: answers *unsupported* there."),
}


def chapter_of(name: str) -> str:
    """Return the chapter of a solver."""
    package = registry.solver_class(name).__module__.removeprefix("cgla_graph.solvers.").split(".")[0]
    return CHAPTERS[package]


def promises(traits: Traits) -> list[str]:
    """Say what a solver promises."""
    said = ["Plans on a graph." if traits.domain == "graph" else "Plans in the plane."]
    said += [sentences[0] if getattr(traits, trait) else sentences[1] for trait, sentences in PROMISES.items()]
    if traits.needs:
        said.append(f"Needs {', '.join(traits.needs)}.")
    return [sentence for sentence in said if sentence]


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in (head, *rows):
        lines += [f"   {'* -' if not at else '  -'} {cell}" for at, cell in enumerate(row)]
    return [*lines, ""]


def _settings(name: str) -> list[str]:
    kind = registry.solver_class(name)
    fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    if not fields:
        return ["It has no settings.", ""]
    rows = [(f"``{one.name}``", f"``{one.default!r}``") for one in fields]
    return ["What each means is told below.", "", *_table(("setting", "default"), rows)]


def page(name: str, when: str) -> str:
    """Write the page of a solver."""
    kind = registry.solver_class(name)
    traits = kind.traits
    lines = [name, "=" * len(name), "", f"*{traits.summary}*", "", when, ""]
    lines += [f".. image:: {name}.png", f"   :alt: The path of {name} on three shipped maps", ""]
    lines += ["Promises", "--------", "", *(f"- {sentence}" for sentence in promises(traits)), ""]
    lines += ["Settings", "--------", "", *_settings(name)]
    called = f'cg.solve(problem, "{name}")'
    lines += [f"In Python ``{called}``, on the command line ``cgla plan SCENARIO --solver {name}``.", ""]
    lines += ["How it works", "------------", "", f".. autoclass:: {kind.__module__}.{kind.__qualname__}", ""]
    return "\n".join(lines)


def alike(names: list[str], folder: Path) -> list[list[str]]:
    """Group solvers with equal pictures."""
    groups: dict[bytes, list[str]] = {}
    for name in names:
        groups.setdefault((folder / f"{name}.png").read_bytes(), []).append(name)
    return list(groups.values())


def index(names: list[str], folder: Path) -> str:
    """Write the page that lists them, with equal pictures once."""
    lines = ["All solvers", "===========", ""]
    lines += [
        f"The {len(names)} solvers of the registry, each with its path on three shipped maps: ``paper`` (threats),",
        "``trap`` (a pocket of threats around the straight line) and ``maze`` (no-fly areas alone). What they have in",
        "common, and how to add one, is told on the page :doc:`/solvers`; which to take, on the page :doc:`/choosing`.",
        "",
    ]
    for chapter in dict.fromkeys(CHAPTERS.values()):
        members = [name for name in names if chapter_of(name) == chapter]
        lines += [chapter, "-" * len(chapter), ""]
        lines += [".. grid:: 1 1 2 2", "   :gutter: 3", ""]
        for same in alike(members, folder):
            lines += ["   .. grid-item-card::", ""]
            lines += [
                f"      .. image:: {same[0]}.png",
                f"         :alt: The path of {', '.join(same)} on three shipped maps",
            ]
            lines += [f"         :target: {same[0]}.html", ""]
            lines += [line for name in same for line in (f"      :doc:`{name}`: {registry.traits(name).summary}", "")]
        lines += [".. toctree::", "   :hidden:", "", *(f"   {name}" for name in members), ""]
    return "\n".join(lines)


def generate(app: Sphinx) -> None:
    """Write all pages and pictures."""
    folder = Path(app.srcdir) / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    when = tomllib.loads((Path(app.srcdir) / "reference" / "when-to-use.toml").read_text(encoding="utf-8"))
    names = registry.names(installed=False)
    if wrong := set(names) ^ set(when):
        msg = f"reference/when-to-use.toml and the registry do not agree on {', '.join(sorted(wrong))}"
        raise ExtensionError(msg)
    solver_pictures.draw(names, folder)
    for name in names:
        write(folder / f"{name}.rst", page(name, when[name].strip()))
    write(folder / "index.rst", index(names, folder))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Generate before any page is read."""
    app.connect("builder-inited", generate)
    return {"version": cg.__version__, "parallel_read_safe": True, "parallel_write_safe": True}
