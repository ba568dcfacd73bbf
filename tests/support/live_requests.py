"""Requests to the server of `cgla live`, as its page sends them."""

import http.client
import json
from typing import Any

from cgla_graph.comparisons.live.server import LiveServer


def own(server: LiveServer) -> dict[str, str]:
    """Return what the page's own requests say."""
    return {"Origin": f"http://127.0.0.1:{server.server_port}", "Content-Type": "application/json"}


def ask(
    server: LiveServer, method: str, path: str, body: bytes | None = None, headers: dict[str, str] | None = None
) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read(), dict(answer.getheaders())
    finally:
        connection.close()


def get(server: LiveServer, what: str) -> bytes:
    status, body, _ = ask(server, "GET", f"/{server.token}/{what}")
    assert status == 200
    return body


def post(server: LiveServer, what: str, document: object, **headers: str) -> tuple[int, dict[str, Any]]:
    data = document if isinstance(document, bytes) else json.dumps(document).encode()
    status, body, _ = ask(server, "POST", f"/{server.token}/{what}", data, {**own(server), **headers})
    return status, json.loads(body)
