"""Files as nobody should write them: those that are right, damaged somewhere."""

import copy
import json
import random
from collections.abc import Callable, Iterable

#: What stands in damaged files: brackets, numbers out of range, words of the formats, beginnings of other files.
TOKENS = (
    b"{", b"}", b"[", b"]", b'"', b",", b":", b"\\", b"<", b">", b"</", b"/>", b"&", b"&a;", b"<!DOCTYPE a>", b"\0",
    b"\xff", b"\xef\xbb\xbf", b"\xff\xfe", b"PK\x03\x04", b"null", b"true", b"NaN", b"1e999", b"-1", b"0", b"99999",
    b"181", b"1" * 400, b"[[[[[[[[", b"<a><a><a>", "é".encode(), b"\n", b" ",
)  # fmt: skip
#: What stands where a value of another kind should.
VALUES: tuple[object, ...] = (
    None, True, 0, -1, 1e308, 10**400, "", "x", "NaN", [], {}, [[]], [None], {"type": 0}, "2026-13-01T00:00:00Z",
    "24:00:00Z", [180.0, 90.0], [1e9, 0.0], "Polygon", "FT", 99999, -99999, [[[0, 0], [0, 0], [0, 0], [0, 0]]],
)  # fmt: skip


def damaged(data: bytes, seed: int) -> bytes:
    """Return bytes with one to four faults: cut off, cut out, doubled, changed, or with something put in."""
    draw = random.Random(seed)  # noqa: S311 - of tests
    for _ in range(draw.randint(1, 4)):
        first = draw.randrange(len(data) + 1)
        last = min(len(data), first + draw.choice((1, 2, 8, 100)))
        data = draw.choice((
            data[:first],
            data[:first] + data[last:],
            data[:last] + data[first:],
            data[:first] + bytes([draw.randrange(256)]) + data[first + 1 :],
            data[:first] + draw.choice(TOKENS) + data[first:],
            data[:first] + draw.choice(TOKENS) + data[last:],
        ))  # fmt: skip
    return data


def damaged_json(data: bytes, seed: int) -> bytes:
    """Return a JSON document in which one to three values are replaced, removed or put under another key."""
    draw = random.Random(seed)  # noqa: S311 - of tests
    document = json.loads(data)
    for _ in range(draw.randint(1, 3)):
        places = list(_places(document))
        if not places:
            break
        where, key = draw.choice(places)
        change = draw.randrange(4)
        if change == 0:
            del where[key]
        elif change == 1 and isinstance(where, dict):
            where[draw.choice((f"{key}s", key.upper(), "x"))] = where.pop(key)
        elif change == 2:
            other, other_key = draw.choice(places)
            where[key] = json.loads(json.dumps(other[other_key])) if other_key in _keys(other) else None
        else:
            # (a copy: what is drawn may be changed later)
            where[key] = copy.deepcopy(draw.choice(VALUES))
    return json.dumps(document).encode()


def tried(read: Callable[[bytes], object], refusal: type[Exception], documents: Iterable[bytes]) -> tuple[int, int]:
    """Read damaged documents; count those that are read, and those refused in one line. Anything else raises."""
    fine = refused = 0
    for document in documents:
        try:
            read(document)
            fine += 1
        except refusal as error:
            if not str(error) or "\n" in str(error):
                message = f"{document[:200]!r} is refused in other than one line: {error}"
                raise AssertionError(message) from error
            refused += 1
    return fine, refused


def _keys(of: list | dict) -> Iterable[object]:  # type: ignore[type-arg]
    return of if isinstance(of, dict) else range(len(of))


def _places(of: object) -> Iterable[tuple]:  # type: ignore[type-arg]
    """List every value of a document: what holds it, and its key there."""
    stack = [of]
    while stack:
        one = stack.pop()
        if isinstance(one, list | dict):
            for key in _keys(one):
                yield one, key
                stack.append(one[key])  # type: ignore[call-overload]
