"""Addresses: the location of a brick as one line of text.

::

    usb://                        the first brick on USB          usb://0016530A1B2C   the one with this id
    bt://00:16:53:0A:1B:2C        Bluetooth, paired before
    serial:///dev/rfcomm0         a Bluetooth serial port         serial://COM5        the same on Windows
    tcp://localhost:2727          a brick served over the network
    nxt-server://localhost:2727   a brick served by nxt-python's nxt-server
    sim://                        the simulator                   sim://my-room.toml?seed=7&latency_ms=30
    replay://bug.nxttrace         a recording as a brick          record://bug.nxttrace?nxt=usb://  makes one

A ``?`` in the name of a file is written ``%3F``, and a ``%`` before ``3F`` or ``25`` is written ``%25``.

Text with a recognisable shape needs no scheme: ``COM5``, ``/dev/rfcomm0``, ``00:16:53:0A:1B:2C``,
``0016530A1B2C``, ``localhost:2727``, ``my-room.toml``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qsl, quote, unquote, urlencode

from firmware_protocol.errors import AddressError
from firmware_protocol.wording import did_you_mean

DEFAULT = "usb://"
"""Opened when neither the program nor ``$NXT`` names a brick."""
WHOLE = ("sim", "usb")
"""Schemes that are addresses without a target."""

MAC = re.compile(r"([0-9A-F]{2}:){5}[0-9A-F]{2}", re.IGNORECASE)
BRICK_ID = re.compile(r"[0-9A-F]{12}", re.IGNORECASE)
"""A brick's Bluetooth address, and the same without colons: its id on USB."""

_SCHEME = re.compile(r"[a-z][a-z0-9+.-]*", re.IGNORECASE)

_SHAPES: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"COM\d+", re.IGNORECASE), "serial"),
    (re.compile(r"/.*[^/]"), "serial"),
    (MAC, "bt"),
    (BRICK_ID, "usb"),
    (re.compile(r"[^\s:?]+\.toml(\?.*)?", re.IGNORECASE), "sim"),
    (re.compile(r"[^\s:?]+\.nxttrace", re.IGNORECASE), "replay"),
    (re.compile(r"[\w.-]+:\d+"), "tcp"),
)
"""Shapes of text without ``://`` and the scheme they imply; the first match is used."""

_QUOTED = re.compile("%(3F|25)", re.IGNORECASE)
_TO_QUOTE = re.compile(r"\?|%(?=3F|25)", re.IGNORECASE)

_BYTES = "surrogateescape"
"""Python's name for its way to keep the bytes of a file's name that are not text in the locale."""

Options = Mapping[str, Callable[[str], Any]]


@dataclass(frozen=True, slots=True)
class Address:
    """A parsed address.

    Attributes:
        scheme: The part before ``://``, in lower case.
        target: An id, a device, ``host:port`` or a world file; may be empty.
        options: The part after the question mark.
    """

    scheme: str
    target: str = ""
    options: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> Address:
        """Parse `text`; a missing scheme is inferred from its shape.

        Raises:
            AddressError: It is not text, or has neither a scheme nor a known shape.
        """
        if not isinstance(text, str):
            raise AddressError(f"{text!r} is not an address: it must be text, as {DEFAULT!r} is.")
        text = text.strip(" \t\r\n")
        scheme, separator, rest = text.partition("://")
        if not separator:
            scheme, rest = _by_shape(text), text
        if not _SCHEME.fullmatch(scheme) or "\0" in text:  # which neither paths nor hosts can have
            raise AddressError(f"{text!r} is not an address.", remedy=f"Try {DEFAULT!r} or 'sim://'.")
        target, _, query = rest.partition("?")
        pairs = parse_qsl(query, keep_blank_values=True, errors=_BYTES)
        names = [name for name, _ in pairs]
        if doubled := {name for name in names if names.count(name) > 1}:
            raise AddressError(f"{text!r} sets {', '.join(sorted(doubled))} more than once.")
        return cls(scheme.lower(), _QUOTED.sub(lambda quoted: unquote(quoted[0]), target), dict(pairs))

    def __str__(self) -> str:
        query = urlencode(self.options, errors=_BYTES, quote_via=quote)
        target = _TO_QUOTE.sub(lambda found: quote(found[0]), self.target)
        return f"{self.scheme}://{target}{'?' if query else ''}{query}"

    def read_options(self, known: Options) -> dict[str, Any]:
        """Return the options as values, each converted as `known` says.

        Raises:
            AddressError: An option is unknown, or its converter refuses the value; the message says what is allowed.
        """
        values = {}
        for name, text in self.options.items():
            if name not in known:
                raise AddressError(f"{self}: unknown option {name!r}.", remedy=_suggest(name, known, "Options are"))
            try:
                values[name] = known[name](text)
            except ValueError as reason:
                raise AddressError(f"{self}: {name}={text} does not fit: {reason}.") from None
        return values


def unknown_scheme(scheme: str, known: Iterable[str]) -> AddressError:
    """Return the error for an unknown scheme; it lists the known ones."""
    known = [f"{name}://" for name in known]
    return AddressError(
        f"there is no transport for {scheme}:// addresses.", remedy=_suggest(f"{scheme}://", known, "Known are")
    )


def _by_shape(text: str) -> str:
    for shape, scheme in _SHAPES:
        if shape.fullmatch(text):
            return scheme
    if (word := text.rstrip(":/").lower()) in WHOLE:
        raise AddressError(f"{text!r} is not an address.", remedy=f"Did you mean '{word}://'?")
    known = ", ".join(("usb://", "bt://", "serial://", "tcp://host:port", "sim://"))
    raise AddressError(
        f"{text!r} is not an address: it does not begin with a scheme such as usb://, and does not look like a port, "
        f"an id or a world file.",
        remedy=f"An address begins with one of {known}; `nxtdrive list` prints complete ones.",
    )


def _suggest(word: str, known: Iterable[str], lead: str) -> str:
    names = sorted(known)
    return f"{did_you_mean(word, names)} {lead} {', '.join(names) if names else 'none'}.".lstrip()
