"""Record a conversation with a brick in the format of the recordings (docs/firmware.md section 0.3)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import count
from typing import Any, Protocol

from firmware_protocol import direct, system
from firmware_protocol.catalog import AnyCommand
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkTimeout, NXTError
from firmware_protocol.status import Status
from firmware_protocol.telegram import REPLY_HEADER, REQUEST_HEADER, Kind
from nxtdrive.brick import STOPPING_S
from nxtdrive.motion.outputs import braked, coasting
from nxtdrive.transports.base import Transport, drain
from sim_backend.firmware.brick import SimBrick

from .bench import Bench
from .differences import DONE, command_of_telegram, variable_at
from .script import Line

REPLY_WITHIN_S = 2.0
"""Longest wait for a reply; over Bluetooth a brick may take a second."""
PASS_MS = 1
"""Time that a telegram costs in a replay."""

PRIVATE_FIELDS: dict[AnyCommand, tuple[str, ...]] = {
    system.GetDeviceInfo: ("name", "address", "link_quality"),
    system.GetBluetoothAddress: ("address",),
    direct.GetBluetoothContactName: ("name",),
    direct.GetBluetoothConnectionName: ("name",),
}
"""Fields of replies that identify the brick, or devices it was connected with."""
PRIVATE_VARIABLES = re.compile(
    r"Display\.Normal|Comm(?!\.(BluecoreVersion|Bt|DeviceCnt|DeviceStatus|DeviceClass|Hs|Usb))"
)
"""The same of IO maps: the screen has the brick's name in its first line, Comm names, addresses, PINs and buffers."""
DEFAULT_NAME = b"NXT"
SHORTEST_NAME = 3
"""A name of fewer bytes is not looked for in all replies."""


class Peer(Protocol):
    """The other end of the conversation."""

    def exchange(self, telegram: bytes) -> tuple[bytes, int]:
        """Send a telegram; return the reply, empty without one, and the milliseconds that passed."""
        ...

    def wait(self, duration_ms: int) -> None:
        """Let time pass."""
        ...


class BenchPeer:
    """The simulated brick on the bench of `nxtdrive sim check`."""

    def __init__(self, firmware: str) -> None:
        self._bench = Bench(SimBrick(firmware=firmware))

    def exchange(self, telegram: bytes) -> tuple[bytes, int]:
        """See `Peer`."""
        return bytes.fromhex(self._bench.telegram(telegram.hex())), PASS_MS

    def wait(self, duration_ms: int) -> None:
        """See `Peer`."""
        self._bench.control(f"!tick {duration_ms}")


class TransportPeer:
    """A brick behind any transport."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def exchange(self, telegram: bytes) -> tuple[bytes, int]:
        """See `Peer`; a reply that comes after `REPLY_WITHIN_S` is dropped."""
        transport = self._transport
        if transport.waiting():
            drain(transport)
        begun_s = transport.now()
        transport.send(telegram)
        reply: bytes | None = b""
        if telegram[0] in (Kind.DIRECT, Kind.SYSTEM):
            reply = transport.receive(REPLY_WITHIN_S)
            while reply and reply[1:2] != telegram[1:2] != b"":  # late, from a telegram before
                reply = transport.receive(begun_s + REPLY_WITHIN_S - transport.now())
        return reply or b"", round((transport.now() - begun_s) * 1000)

    def wait(self, duration_ms: int) -> None:
        """See `Peer`."""
        self._transport.sleep(duration_ms / 1000)


class Anonymizer:
    """Blanks and masks data that identify the brick.

    Args:
        device: Of this brick; its name and address are blanked wherever they appear.
    """

    def __init__(self, device: system.DeviceInfo) -> None:
        name, address = device.name.encode("latin-1", "replace"), device.address[:6]
        known = len(name) < SHORTEST_NAME or name == DEFAULT_NAME
        self._secrets = [address] if known else [name, address]

    def blank(self, request: bytes, reply: bytes) -> tuple[bytes, bytes]:
        """Return the reply with zeros in place of private bytes, and its mask, empty if there are none."""
        places = set(_private_offsets(request, reply))
        for secret in self._secrets:
            for found in re.finditer(re.escape(secret), reply):
                places.update(range(*found.span()))
        if not places:
            return reply, b""
        blanked = bytes(0 if place in places else byte for place, byte in enumerate(reply))
        return blanked, bytes(0 if place in places else 0xFF for place in range(len(reply)))


def _private_offsets(request: bytes, reply: bytes) -> Iterator[int]:
    """Yield the offsets of private bytes in the reply, by the command."""
    command = command_of_telegram(request)
    if command is system.IOMapRead:
        start = REPLY_HEADER + command.reply_type.layout.size
        short = len(request) < REQUEST_HEADER + command.layout.size  # completed by the brick, so it may read anything
        for place in range(start, len(reply)):
            if short or PRIVATE_VARIABLES.match(variable_at(request, place - start)):
                yield place
    elif command is not None:
        for field in PRIVATE_FIELDS.get(command, ()):
            begin, end = command.reply_type.layout.spans[field]
            yield from range(REPLY_HEADER + begin, min(REPLY_HEADER + end, len(reply)))


def ask_identity(peer: Peer) -> system.DeviceInfo:
    """Ask the brick for its name and address.

    Raises:
        LinkTimeout: It does not answer.
        RemoteProtocolError: It answers something else.
    """
    command = system.GetDeviceInfo()
    return type(command).decode_reply(_answer(peer, command.encode()))


def record_conversation(
    peer: Peer, lines: Iterable[Line], scenario: str, about: str, anonymizer: Anonymizer | None
) -> Iterator[dict[str, Any]]:
    """Hold the conversation, beginning with the firmware's version; yield the recording's lines.

    Args:
        peer: The other end.
        lines: What to send and when to wait.
        scenario: Name of the conversation.
        about: Its subject, in words.
        anonymizer: Blanks private bytes; None keeps them.

    Raises:
        LinkError: The link is lost, or the brick does not answer at the beginning.
    """
    number = count()

    def step(**fields: str) -> dict[str, Any]:
        given = {key: value for key, value in fields.items() if value or key == "reply"}
        return {"scenario": scenario, "step": next(number), **given}

    request = system.GetVersions().encode()
    reply = _answer(peer, request)
    firmware = system.GetVersions.decode_reply(reply).firmware
    yield step(about=about, firmware=firmware, request=request.hex(), reply=reply.hex())
    for line in lines:
        if line.wait_ms:
            peer.wait(line.wait_ms)
            yield step(control=f"!tick {line.wait_ms}", reply=DONE, note=line.note)
            continue
        reply, elapsed_ms = peer.exchange(line.telegram)
        reply, mask = anonymizer.blank(line.telegram, reply) if anonymizer else (reply, b"")
        yield step(request=line.telegram.hex(), reply=reply.hex(), mask=mask.hex(), note=line.note)
        if elapsed_ms > PASS_MS:
            yield step(control=f"!tick {elapsed_ms - PASS_MS}", reply=DONE, note="measured: how long the exchange took")


def stop(transport: Transport) -> None:
    """Stop a program that runs on the brick, and all motors, as far as the link allows; its errors are ignored."""
    peer = TransportPeer(transport)
    with suppress(NXTError):
        running, _ = peer.exchange(direct.GetCurrentProgramName().encode())
        if running[REPLY_HEADER - 1 : REPLY_HEADER] == bytes([Status.OK]):
            peer.exchange(direct.StopProgram().encode())
    with suppress(NXTError):
        transport.send(braked(OutputPort.ALL).encode(want_reply=False))
        transport.sleep(STOPPING_S)
        transport.send(coasting(OutputPort.ALL).encode(want_reply=False))


def _answer(peer: Peer, request: bytes) -> bytes:
    reply, _ = peer.exchange(request)
    if not reply:
        raise LinkTimeout("the brick does not answer.", remedy="Switch it on and try `nxtdrive doctor`.")
    return reply
