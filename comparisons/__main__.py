"""``python -m cgla_graph.comparisons`` is `cgla`."""

from cgla_graph.comparisons.commands.app import main

if __name__ == "__main__":
    main()
