"""Make damaged and odd files from good ones."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

VALUES = (
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"NaN",
        b"Infinity",
        b"1e999",
        b"-1e308",
        b"1e-320",
        b"0",
        b"-0.0",
        b"-1",
        b"0.5",
        b"true",
    ),
    *(
        b"null",
        b'""',
        b"[]",
        b"{}",
        b"[[]]",
        b'{"a": 1}',
        b"{a = 1}",
        b"'x'",
        b'"\\ud800"',
        b'"\\u0000"',
        b"1979-05-27",
    ),
    *(b"9" * 20, b"9" * 400, b"9" * 5000, b"0x" + b"f" * 300, b"99999", b"-99999", b'"' + b"x" * 3000 + b'"'),
    *(
        b'"nan"',
        b'"../.."',
        b'"/dev/zero"',
        b'"' + b"y" * 300 + b'"',
        b"[1, 2, 3]",
        b'["a", "b"]',
        b"1e6",
        b"3000000000",
    ),
)
"""Odd values that replace valid ones."""
BYTES = (
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"\r",
    b"\n",
    b"\\",
    b'"',
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b"<",
    b">",
    b"#",
    b"\xe2\x80\xa8",
)
_VALUE = re.compile(rb"""(?<=[=:\[,])[ \t]*(?:"[^"\n]*"|'[^'\n]*'|-?[\w.+-]+|\[[^\[\]\n]*\])""")
_NUMBER = re.compile(rb"(?<![\w.])-?\d{1,15}(?:\.\d{1,15})?(?![\w.])")


def mutated(content: bytes, random: Random) -> bytes:
    """Return the content with one to four mutations."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        content = random.choice(_WAYS)(content, random)
    return content


def _value(content: bytes, random: Random) -> bytes:
    found = list(_VALUE.finditer(content))
    if not found:
        return _flip(content, random)
    chosen = random.choice(found)
    return content[: chosen.start()] + b" " + random.choice(VALUES) + content[chosen.end() :]


def _scale(content: bytes, random: Random) -> bytes:
    found = list(_NUMBER.finditer(content))
    if not found:
        return _flip(content, random)
    chosen = random.choice(found)
    factor = random.choice((0, -1, 2, 0.5, 1000, 1e-3, 1e6, 1e-9, 1e200))
    scaled = f"{float(chosen[0]) * factor:g}".encode()
    return content[: chosen.start()] + scaled + content[chosen.end() :]


def _swap_values(content: bytes, random: Random) -> bytes:
    found = list(_VALUE.finditer(content))
    if len(found) < 2:
        return _flip(content, random)
    one, other = sorted(random.sample(found, 2), key=re.Match.start)
    between = content[one.end() : other.start()]
    return content[: one.start()] + other[0] + between + one[0] + content[other.end() :]


def _flip(content: bytes, random: Random) -> bytes:
    if not content:
        return random.choice(BYTES)
    at = random.randrange(len(content))
    return content[:at] + bytes((content[at] ^ 1 << random.randrange(8),)) + content[at + 1 :]


def _insert(content: bytes, random: Random) -> bytes:
    at = random.randint(0, len(content))
    piece = random.choice((random.choice(BYTES), random.randbytes(random.randint(1, 40)), random.choice(VALUES)))
    return content[:at] + piece + content[at:]


def _span(content: bytes, random: Random) -> tuple[int, int]:
    start = random.randint(0, len(content))
    return start, min(len(content), start + random.choice((1, 10, 100, 1000)))


def _delete(content: bytes, random: Random) -> bytes:
    start, end = _span(content, random)
    return content[:start] + content[end:]


def _repeat(content: bytes, random: Random) -> bytes:
    start, end = _span(content, random)
    return content[:end] + content[start:end] * random.choice((1, 2, 50)) + content[end:]


def _lines(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    random.shuffle(lines)
    return b"\n".join(lines[: random.randint(0, len(lines))])


def _cut(content: bytes, random: Random) -> bytes:
    return content[: random.randint(0, len(content))]


def _nest(content: bytes, random: Random) -> bytes:
    depth = random.choice((10, 100, 1000, 10_000))
    opening, middle, closing = random.choice(
        ((b"[", b"1", b"]"), (b'{"a":', b"1", b"}"), (b"{a=", b"1", b"}"), (b"a.", b"b", b""), (b"<a>", b"", b"</a>"))
    )
    deep = opening * depth + middle + closing * depth
    found = list(_VALUE.finditer(content))
    if not found or random.random() < 0.3:
        return content + b"\n" + deep + b" = 1\n"
    chosen = random.choice(found)
    return content[: chosen.start()] + deep + content[chosen.end() :]


_WAYS: tuple[Callable[[bytes, Random], bytes], ...] = (
    *(_scale, _scale, _scale, _scale, _value, _value, _value, _value, _swap_values),
    *(_flip, _insert, _insert, _delete, _repeat, _lines, _cut, _nest),
)
