"""A server in a thread of this process."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

from cgla_graph.comparisons.report.loopback import LoopbackServer

ServerT = TypeVar("ServerT", bound=LoopbackServer)


@contextmanager
def serving(server: ServerT) -> Iterator[ServerT]:
    """Answer requests while the body runs."""
    with server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()
