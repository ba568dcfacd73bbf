"""``python -m cgla_graph.comparisons`` is `cgla`."""

from cgla_graph.comparisons.cli.app import main

if __name__ == "__main__":
    main()
