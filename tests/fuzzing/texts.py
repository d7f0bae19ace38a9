"""Mutations of a scene as bytes and as lines, blind to what they mean."""

import random
from collections.abc import Callable

_PIECES = (
    *(b"\0", b"\r", b"\n", b'"', b"'", b"\\", b"[", b"]", b"{", b"}", b"=", b".", b",", b"#", b" ", b"\t", b"9", b"-"),
    *(b"e",),
)
_BAD = (
    *(b"\xff", b"\xc0\x80", b"\xed\xa0\x80", b"\xf8\x88\x80\x80\x80", b"\x80", b"\xe2\x82", b"\xef\xbb\xbf"),
    *(b"\xe2\x80\xa8",),
)
_UNICODE = ("\u202e", "\u200b", "\u00a0", "é", "рhi", "²", "٣", "𝟛", "\U0001f600", "ﬁ", "\u0085", "\u2028")

Mutation = Callable[[random.Random, bytes], bytes]


def _flip(rng: random.Random, content: bytes) -> bytes:
    some = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8))):
        some[rng.randrange(len(some))] ^= 1 << rng.randrange(8)
    return bytes(some)


def _cut(rng: random.Random, content: bytes) -> bytes:
    a, b = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[: a + (b - a) // 4] + content[b:] if rng.random() < 0.5 else content[:a]


def _insert(rng: random.Random, content: bytes) -> bytes:
    pieces = (*_PIECES, *_BAD, *(text.encode() for text in _UNICODE))
    for _ in range(rng.choice((1, 1, 3))):
        spot = rng.randrange(len(content) + 1)
        content = content[:spot] + rng.choice(pieces) * rng.choice((1, 1, 1, 2, 100)) + content[spot:]
    return content


def _encoded(rng: random.Random, content: bytes) -> bytes:
    text = content.decode("utf-8", "replace")
    ways: tuple[Callable[[], bytes], ...] = (
        *(lambda: text.encode("utf-16"), lambda: text.encode("utf-16-be"), lambda: text.encode("utf-32")),
        *(lambda: b"\xef\xbb\xbf" * rng.choice((1, 2)) + content, lambda: content.replace(b"\n", b"\r")),
        *(lambda: content.replace(b"\n", b"\r\n"),),
        *(lambda: content.replace(b"\n", rng.choice((b"\n\r", b"\x0b", b"\x0c", b"\0"))),),
        *(lambda: text.encode("latin-1", "replace"), lambda: content + b"\0" * 1000, lambda: content + b"\x1a"),
    )
    return rng.choice(ways)()


def _doubled(rng: random.Random, content: bytes) -> bytes:
    return rng.choice((content + content, content * 50, content + content[: len(content) // 2], b""))


def _lines(rng: random.Random, content: bytes) -> bytes:
    """A line dropped, doubled, moved, swapped with another, or its key renamed."""
    lines = content.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    way = rng.randrange(5)
    if way == 0:
        del lines[i]
    elif way == 1:
        lines.insert(j, lines[i])
    elif way == 2:
        lines.insert(j, lines.pop(i))
    elif way == 3:
        lines[i], lines[j] = lines[j], lines[i]
    else:
        lines[i] = rng.choice((b"x", b"a.b.", b"1", b"-", b'"a b"', b"[", b"[[")) + lines[i]
    return b"\n".join(lines)


def _joined(rng: random.Random, content: bytes) -> bytes:
    """Hundreds of copies of one line, or that line made very long."""
    lines = content.split(b"\n")
    i = rng.randrange(len(lines))
    lines[i] = rng.choice((b"\n".join([lines[i]] * 300), lines[i] * 300, lines[i] + b"#" * 10**5))
    return b"\n".join(lines)


BYTES: tuple[Mutation, ...] = (_flip, _flip, _cut, _insert, _insert, _encoded, _doubled, _lines, _lines, _joined)
"""Each takes a random generator and a file's content, and gives another content."""
