"""``python -m cgla_graph.comparisons`` is `cgla`."""

from cgla_graph.comparisons.cli import main

if __name__ == "__main__":
    main()
