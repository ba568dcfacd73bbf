"""How Sphinx builds the site: `make docs`. Nothing is fetched, neither here nor by whoever reads it."""

import re
import sys
from pathlib import Path

import matplotlib as mpl
from numpy.typing import ArrayLike
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

import cgla_graph
from cgla_graph._types import BoolArray, FloatArray, IntArray, WholeArray

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS / "_extensions"))
mpl.use("agg")

project = "CGLA Graph"
version = release = cgla_graph.__version__
project_copyright = "its authors, MIT licence"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "excerpts",
    "gallery",
    "mathml",
    "section_pages",
    "solver_pages",
]
root_doc = "index"
# the index shows it
exclude_patterns = ["README.md", "_extensions", "figures"]
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4

templates_path = ["_templates"]
autosummary_generate = True
autodoc_typehints = "signature"
autodoc_member_order = "groupwise"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
default_role = "code"
numpydoc_show_class_members = False
numpydoc_use_plots = False
numpydoc_xref_param_type = False
# all checks, but for
numpydoc_validation_checks = {
    "all",
    "ES01",  # one sentence may be all there is to say
    "EX01",  # methods are shown at work in the example of their class
    "PR01",  # fields of dataclasses are attributes; what the one line of a method says needs no table
    "PR04",  # types are in signatures, once
    "RT01",  # as PR01
    "SA01",  # the tables of the reference say what belongs together
    "YD01",  # as PR01
}

# its signature is that of its `__init__`, not of the `__new__` that pickles need
numpydoc_validation_exclude = {r"\.RiskField$"}

nitpick_ignore_regex = [
    # names of others: there is nothing here to link them to
    ("py:.*", r"(collections|datetime|fractions|matplotlib|networkx|np|numpy|nx|os|pathlib|scipy|shapely)\..*"),
    # what hints name as text, as it is imported by type checkers alone
    ("py:class", r"[A-Z]\w+"),
    # a hint with a comma in quotation marks, taken apart by Sphinx
    ("py:class", r"tuple\[float"),
    # what is handed on from one function to the next has no page: hints show it as text
    ("py:class", r"cgla_graph\.\w+(\.\w+)+"),
]

html_theme = "furo"
html_title = "CGLA Graph"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["tables.js"]
html_show_sphinx = False
html_copy_source = False
# what a block prints is not for copying
copybutton_selector = "div:not(.highlight-text) > div.highlight > pre"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5f8b", "color-brand-content": "#1f5f8b"},
    "dark_css_variables": {"color-brand-primary": "#7fb8de", "color-brand-content": "#7fb8de"},
}

#: The line below a page's title that leads back, for who reads it where the code is.
_WAY_BACK = re.compile(r"^\[Manual\]\([./]*README\.md\).*\n\n?", re.MULTILINE)
#: A file's name above the block that shows it.
_FILE = re.compile(r"^\*\*`([\w.-]+)`\*\*\n```(\w+)\n", re.MULTILINE)


def _for_the_site(_app: Sphinx, name: str, source: list[str]) -> None:
    """Leave out the way back and links to what the site has not, and make names of files captions of their blocks."""
    text = re.sub(r"\]\(((?:\.\./)?)README\.md\)", r"](\1index.md)", _WAY_BACK.sub("", source[0]))
    text = re.sub(rf"\[([^\]]+)\]\((?:\.\./){{{name.count('/') + 1}}}\w+\.md\)", r"\1", text)
    source[0] = _FILE.sub(r"```{code-block} \2\n:caption: \1\n\n", text)


def _without_fields(_app: Sphinx, _kind: str, _name: str, member: object, _skip: bool, _options: object) -> bool | None:
    """Leave out the fields of a named tuple, which its docstring tells as attributes."""
    return True if type(member).__name__ == "_tuplegetter" else None


#: What hints stand for where Sphinx spells them out, after its own spelling.
_SPELLED = {
    stringify_annotation(ArrayLike, "smart"): "ArrayLike",
    **{stringify_annotation(one, "smart"): "numpy.ndarray" for one in (BoolArray, FloatArray, IntArray, WholeArray)},
    "<factory>": "...",
}


def _without_checks(hints: str) -> str:
    """Write ``Annotated[int, check]`` as ``int``."""
    while (start := hints.find("Annotated[")) >= 0:
        first, depth, at = start + len("Annotated["), 0, start + len("Annotated[")
        comma = None
        while depth >= 0:
            if hints[at] == "," and depth == 0 and comma is None:
                comma = at
            depth += (hints[at] in "[(") - (hints[at] in "])")
            at += 1
        before = hints[:start].removesuffix("typing.").removesuffix("types.").removesuffix("~")
        hints = before + hints[first:comma] + hints[at:]
    return hints


def _shorter(_app: Sphinx, _kind: str, _name: str, _thing: object, _options: object, *signature: str | None) -> tuple:
    """Write hints as the code does."""
    arguments, returned = signature
    for spelled, short in _SPELLED.items():
        arguments = arguments and arguments.replace(spelled, short)
        returned = returned and returned.replace(spelled, short)
    return arguments and _without_checks(arguments), returned and _without_checks(returned)


def setup(app: Sphinx) -> None:
    """Prepare pages before they are parsed, and choose what is told of a class."""
    app.connect("source-read", _for_the_site)
    app.connect("autodoc-skip-member", _without_fields)
    # after numpydoc, which gives docstrings the first word
    app.connect("autodoc-process-signature", _shorter, priority=900)
