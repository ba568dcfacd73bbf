"""What the command `live` does: a page on this machine where a map is changed by hand."""

from cgla_graph.comparisons.live.server import serve


def run(spec: str, *, port: int, browser: bool) -> None:
    """
    Serve the page until Ctrl-C, and say where it is.

    Raises
    ------
    CglaError
        If there is no such map, or the port cannot be listened on.
    """
    serve(spec, port=port, open_browser=browser)
