"""Campaign: any telegram to the simulated brick, over both framings."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from firmware_protocol.direct import GetBatteryLevel, LSRead
from firmware_protocol.framing import (
    BLUETOOTH_TELEGRAM_LIMIT,
    LENGTH_LIMIT,
    LENGTH_SIZE,
    USB_TELEGRAM_LIMIT,
    FrameReader,
    frame,
    usb_packets,
)
from firmware_protocol.system import IOMapWrite, Read, Write
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Kind
from sim_backend.devices.analog import AnalogInput
from sim_backend.devices.digital import GenericI2CDevice
from sim_backend.doors.door import completed
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.simulation import Simulation

from .assembler import sample_program, store
from .campaign import Campaign, GuaranteeViolated, Tally, Violation
from .hostile import random_request

BATCH = 250
"""Telegrams that one brick gets."""

PAUSES_MS = (*[0] * 8, *[1] * 6, 2, 3, 5, 10, 20, 101)
LONG_PAUSES_MS = (400, 1000, 5000)
"""Time between telegrams, and the long pause that occurs once in a thousand times."""

WORLDS = 0.1
"""Share of the bricks that drive a robot in a world; the others have motors and sensors on a bench."""

SPLIT = 256
"""Length of a Write over Bluetooth that the firmware takes for two. Source: docs/firmware.md section 1, fact 20."""

CHECK, GOOD = GetBatteryLevel().encode(), GetBatteryLevel.encode_reply()
"""A plain request, sent after one telegram in ten, and the head of its reply."""


class _Rig:
    """A brick, and how its time passes."""

    def __init__(self, rng: Random) -> None:
        self.firmware = rng.choice(FIRMWARES)
        self.bluetooth = rng.random() < 0.5
        self.advance: Callable[[int], None]
        if rng.random() < WORLDS:
            simulation = Simulation(rng.choice(("arena", "open")), firmware=self.firmware)
            self.brick, self.advance = simulation.brick, simulation.advance
        else:
            self.brick = SimBrick(firmware=self.firmware)
            self.advance = self.brick.tick
            for port in "ABC":
                self.brick.attach_motor(port, BenchMotor())
            self.brick.attach_sensor(1, AnalogInput(lambda: rng.randrange(1024)))
            self.brick.attach_sensor(4, GenericI2CDevice())
        self.frames = FrameReader(LENGTH_LIMIT)
        store(self.brick, "a.rxe", sample_program())

    def exchange(self, *pieces: bytes) -> list[tuple[bytes, bytes]]:
        """Send what a program writes; return each telegram that the brick got, with its reply if there was one."""
        if not self.bluetooth:
            return [(packet, self.brick.receive(packet) or b"") for piece in pieces for packet in usb_packets(piece)]
        telegrams = [telegram for piece in pieces for telegram in completed(self.frames, piece)]
        return [(telegram, self.brick.receive_bluetooth(frame(telegram))) for telegram in telegrams]

    def revive(self) -> None:
        """Switch a brick on again after a request to switch itself off."""
        self.brick.io_control.power_word = self.brick.ui.registers.force_off = 0


def run(seed: int, numbers: range) -> Tally:
    """Send these telegrams, each batch to a brick of its own."""
    tally = Tally()
    rng = Random(f"{seed} {numbers.start // BATCH}")  # noqa: S311 - repeatable
    rig = _Rig(rng)
    for number in numbers:
        telegram = random_request(rng)
        try:
            tally.outcomes[_try(rig, rng, telegram)] += 1
        except Exception as error:  # noqa: BLE001 - that is what the campaign looks for
            link = "Bluetooth" if rig.bluetooth else "USB"
            text = f"{telegram.hex()} over {link}, firmware {rig.firmware}: {error!r}"
            tally.violations.append(Violation(number, text))
            rig = _Rig(rng)
    return tally


def _try(rig: _Rig, rng: Random, telegram: bytes) -> str:
    """Send one telegram, let time pass, and return the outcome."""
    outcome = "incomplete"
    for request, reply in rig.exchange(*_pieces(rng, telegram) if rig.bluetooth else (telegram,)):
        outcome = _classified(rig, request, reply) if reply else "no reply"
    rig.advance(rng.choice(LONG_PAUSES_MS if rng.random() < 0.001 else PAUSES_MS))
    if rig.brick.powered_off:
        rig.revive()
        return "switched off"
    if rng.random() < 0.1:
        rig.frames.reset()  # as a pause does
        replies = rig.exchange(frame(CHECK) if rig.bluetooth else CHECK)
        if len(replies) != 1 or not replies[0][1][LENGTH_SIZE if rig.bluetooth else 0 :].startswith(GOOD):
            raise GuaranteeViolated(f"after it GetBatteryLevel gets the reply {replies}")
    return outcome


def _pieces(rng: Random, telegram: bytes) -> list[bytes]:
    """Return a telegram as it arrives in a stream: whole, in pieces, twice at once, or with a wrong length."""
    framed = frame(telegram)
    match rng.randrange(8):
        case 0:
            return [framed[i : i + 1] for i in range(len(framed))]
        case 1:
            cut = rng.randrange(len(framed))
            return [framed[:cut], framed[cut:]]
        case 2:
            return [framed * 2]
        case 3 if rng.random() < 0.1:
            return [rng.randbytes(LENGTH_SIZE) + telegram]
        case _:
            return [framed]


def _classified(rig: _Rig, request: bytes, reply: bytes) -> str:
    """Return the outcome that a reply means."""
    if rig.bluetooth and len(request) > BLUETOOTH_TELEGRAM_LIMIT and (len(request) == SPLIT or not _is_write(request)):
        return _classified_pieces(request, reply)
    limit = USB_TELEGRAM_LIMIT
    if rig.bluetooth:
        announced, reply, limit = int.from_bytes(reply[:LENGTH_SIZE], "little"), reply[LENGTH_SIZE:], LENGTH_LIMIT
        if announced != len(reply) and reply[1] != Read.opcode:  # long reads are cut short
            raise GuaranteeViolated(f"a reply of {len(reply)} bytes announces {announced}")
    kind = request[0] & ~NO_REPLY
    if request[1:2] == bytes([IOMapWrite.opcode]) and len(reply) > 1:
        reply = reply[:1] + request[1:2] + reply[2:]  # what was written may have replaced the opcode
    command = COMMANDS.get((Kind(kind), reply[1])) if kind in tuple(Kind) and len(reply) > 1 else None
    if reply[:1] != bytes([Kind.REPLY]):
        raise GuaranteeViolated(f"the reply is {reply.hex()}")
    if command is None or command.since > rig.firmware:
        return "unknown opcode"  # such a reply is longer than the request, also beyond the limit
    if rig.bluetooth and command is Read and len(reply) > limit:
        return "in pieces"  # docs/firmware.md section 2
    if not REPLY_HEADER <= len(reply) <= limit:
        raise GuaranteeViolated(f"the reply is {reply.hex()}")
    if reply[2] not in command.success:
        # a refused LSRead is shorter by its bytes that wait; the driver reads no fields of a refusal
        if len(reply) != REPLY_HEADER and command is not LSRead:
            command.decode_reply(reply)
        return "refused"
    command.decode_reply(reply)
    return "carried out"


def _is_write(request: bytes) -> bool:
    return (request[0] & ~NO_REPLY, request[1]) == (Kind.SYSTEM, Write.opcode)


def _classified_pieces(request: bytes, reply: bytes) -> str:
    """Return the outcome of a telegram longer than the buffer: each piece of that size is a telegram of its own."""
    pieces, replies, rest = -(-len(request) // BLUETOOTH_TELEGRAM_LIMIT), 0, reply
    while rest and rest[LENGTH_SIZE + 1 : LENGTH_SIZE + 2] != bytes([Read.opcode]):  # long reads are cut short
        end = LENGTH_SIZE + int.from_bytes(rest[:LENGTH_SIZE], "little")
        if len(rest) < end or replies == pieces:
            raise GuaranteeViolated(f"a telegram of {pieces} pieces gets the reply {reply.hex()}")
        replies, rest = replies + 1, rest[end:]
    return "split"


CAMPAIGN = Campaign(
    guarantee="No telegram makes the simulated brick fail: it replies as declared or not at all, and keeps answering.",
    unit="telegrams",
    count=1_000_000,
    batch=BATCH,
    run=run,
)
