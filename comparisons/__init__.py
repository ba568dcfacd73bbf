"""Comparisons: every solver over the same cost, as tables, pictures and files; and the command line."""

from cgla_graph._lazy import lazy

__getattr__, __dir__, __all__ = lazy(__name__)
