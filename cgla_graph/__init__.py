"""
CGLA Graph: risk-aware path planning over complete geometric graphs.

The public names are listed in ``__init__.pyi``. They are imported when first used, so that `import cgla_graph` and
``cgla --help`` cost next to nothing.
"""

import sys
from importlib import import_module
from typing import Any, cast

from cgla_graph._lazy import lazy, set_importer
from cgla_graph._moved import OldNames

__version__ = "0.2.0"

sys.meta_path.insert(0, cast("Any", OldNames))

__getattr__, __dir__, __all__ = lazy(__name__)

_INTERNAL = {"html": "plots.notebook"}


def _import_for_objects(name: str) -> Any:  # noqa: ANN401 - a function
    """Import a function that objects on lower floors call, as `Problem.plot` calls `plot`."""
    if name in _INTERNAL:
        return getattr(import_module(f"cgla_graph.{_INTERNAL[name]}"), name)
    return __getattr__(name)


set_importer(_import_for_objects)
