"""Campaign: hostile replies to the driver, as packets and in a stream."""

from __future__ import annotations

from collections import defaultdict, deque
from random import Random
from typing import Any

from firmware_protocol.direct import (
    GetBatteryLevel,
    GetInputValues,
    GetOutputState,
    KeepAlive,
    LSGetStatus,
    MessageRead,
    PlayTone,
)
from firmware_protocol.enums import InputPort, OutputPort
from firmware_protocol.errors import NXTError
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, LENGTH_SIZE, USB_TELEGRAM_LIMIT, frame
from firmware_protocol.iomap import COMMAND, OUTPUT, UI
from firmware_protocol.system import GetDeviceInfo, GetVersions, IOMapRead, OpenRead
from firmware_protocol.telegram import COMMANDS, REPLY_HEADER, Command, Kind
from nxtdrive.link.link import Link
from nxtdrive.onboard.display import read_display
from nxtdrive.onboard.files import FileEntry, Files
from nxtdrive.transports.stream import StreamTransport
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.files.loader import HANDLES
from sim_backend.firmware.motors.bench_motor import BenchMotor

from .campaign import Campaign, GuaranteeViolated, Tally, Violation
from .hostile import mutated, peak_memory_kb

BATCH = 250
"""Operations over one link."""

TIMEOUT_S, LATE_S, LIMIT_S = 1.0, 1.6, 5.0
"""Timeout of a reply, delay of a late one, and longest time of one request: two timeouts, and a drained stream."""

MEMORY_LIMIT_KB = 64 * 1024
"""Largest memory that a batch may need."""

TRANSFER_LIMIT_S = 60.0
"""Longest time of a transfer of many requests; each attempt ends at its first missing reply."""

CHANGES = ("changed", "truncated", "extended", "wrong size")
"""Changes to the bytes of a reply; of these, a changed value may pass for a right one."""

MOVES = ("twice", "late", "lost", "after an earlier one")
"""Changes to whole replies."""

STREAMED = ("wrong length", "behind noise", "cut off", "in pieces")
"""Changes to a reply in a stream."""

WHOLE = ("truncated", *MOVES, "cut off", "in pieces")
"""Changes during transfers, without changed bytes of a file, which cannot be distinguished from right ones."""

CONTENT = bytes(range(200))
LISTED = [FileEntry("a.bin", len(CONTENT)), FileEntry("NVConfig.sys", 6)]
_REQUESTS: tuple[Command[Any], ...] = (
    *(GetOutputState(OutputPort(port)) for port in range(3)),
    *(GetInputValues(InputPort(port)) for port in range(4)),
    *(LSGetStatus(InputPort(port)) for port in range(2)),
    *(MessageRead(box, box, True) for box in range(2)),
    *(IOMapRead(UI.module_id, offset, size) for offset in (0, 6, 26) for size in (1, 2, 10)),
    COMMAND.field("Tick").read(),
    IOMapRead(OUTPUT.module_id, 0, 55),
    GetBatteryLevel(),
    GetDeviceInfo(),
    GetVersions(),
    KeepAlive(),
    OpenRead("missing"),
    PlayTone(440, 10),
)


class _Wire:
    """A simulated brick whose replies are tampered with, on a clock of its own.

    Attributes:
        fault: What happens to the next reply, or empty.
        rate: Share of the other replies that are tampered with.
        faults: What may happen to them.
        sound: All replies of the brick, untouched, by the part of a request that its reply repeats.
        reports_waiting: Whether it can report that a telegram waits.
        brick: The brick.
    """

    address, max_telegram, simulated = "wire://", USB_TELEGRAM_LIMIT, True

    def __init__(self, rng: Random) -> None:
        self.rng, self.fault, self.rate = rng, "", 0.0
        self.faults: tuple[str, ...] = CHANGES + MOVES
        self.sound: dict[bytes, set[bytes]] = defaultdict(set)
        self.reports_waiting = rng.random() < 0.5
        self.brick = SimBrick()
        for port in "ABC":
            self.brick.attach_motor(port, BenchMotor())
        self._earlier: list[bytes] = []
        self._due: deque[tuple[float, bytes]] = deque()
        self._now_s = self._last_s = 0.0

    def send(self, telegram: bytes) -> None:
        """Let the brick answer."""
        reply = self.answer(telegram)
        self.brick.tick()
        self._now_s += 0.001
        if not reply:
            return
        self.sound[reply_head(telegram)].add(reply)
        fault, self.fault = self.fault, ""
        if not fault and self.rng.random() < self.rate:
            fault = self.rng.choice(self.faults)
        self.tamper(fault, reply)
        self._earlier = [*self._earlier[-20:], reply]

    def answer(self, telegram: bytes) -> bytes | None:
        """Return the brick's reply."""
        return self.brick.receive(telegram)

    def tamper(self, fault: str, reply: bytes) -> None:
        """Send a reply, tampered with."""
        match fault:
            case "changed":
                self.arrive(mutated(self.rng, reply))
            case "truncated":
                self.arrive(reply[: self.rng.randrange(1, len(reply))])
            case "extended":
                self.arrive((reply + self.rng.randbytes(self.rng.randint(1, 8)))[: self.max_telegram])
            case "wrong size":
                self.arrive(_resized(self.rng, reply))
            case "twice":
                self.arrive(reply)
                self.arrive(reply)
            case "late":
                self.arrive(reply, LATE_S)
            case "after an earlier one":
                self.arrive(self.rng.choice(self._earlier or [reply]))
                self.arrive(reply)
            case "lost":
                pass
            case _:
                self.arrive(reply)

    def arrive(self, data: bytes, delay_s: float = 0.0) -> None:
        """Deliver a telegram after earlier ones."""
        self._last_s = max(self._last_s, self._now_s + delay_s)
        self._due.append((self._last_s, data))

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next telegram."""
        if self._due and self._due[0][0] <= self._now_s + timeout_s:
            due_s, data = self._due.popleft()
            self._now_s = max(self._now_s, due_s)
            return data
        self._now_s += max(timeout_s, 0.0001)
        return None

    def waiting(self) -> bool:
        """Return whether a telegram waits, if this wire can tell."""
        return self.reports_waiting and bool(self._due) and self._due[0][0] <= self._now_s

    def now(self) -> float:
        """Return the time."""
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        """Let time pass."""
        self._now_s += duration_s

    def close(self) -> None:
        """Do nothing."""


class _Stream(StreamTransport):
    """The same brick behind a byte stream, which the driver's own code reads."""

    simulated = True

    def __init__(self, wire: _Wire) -> None:
        self.wire = wire
        self.now, self.sleep = wire.now, wire.sleep  # type: ignore[method-assign] # the wire's clock
        super().__init__("stream://")

    def _write(self, data: bytes) -> None:
        self.wire.send(data[LENGTH_SIZE:])

    def _read(self, timeout_s: float) -> bytes:
        return self.wire.receive(timeout_s) or b""

    def _close(self) -> None:
        pass


class _FramedWire(_Wire):
    """A wire that carries frames."""

    max_telegram = BLUETOOTH_TELEGRAM_LIMIT

    def __init__(self, rng: Random) -> None:
        super().__init__(rng)
        self.faults += STREAMED

    def answer(self, telegram: bytes) -> bytes | None:
        """See `_Wire.answer`."""
        return self.brick.receive_bluetooth(frame(telegram))[LENGTH_SIZE:]

    def tamper(self, fault: str, reply: bytes) -> None:
        """See `_Wire.tamper`."""
        framed = frame(reply)
        match fault:
            case "wrong length":
                super().arrive(self.rng.randbytes(2) + reply)
            case "behind noise":
                super().arrive(self.rng.randbytes(self.rng.randint(1, 9)) + framed)
            case "cut off":
                super().arrive(framed[: self.rng.randrange(1, len(framed))])
            case "in pieces":
                for i in range(len(framed)):
                    super().arrive(framed[i : i + 1])
            case _:
                super().tamper(fault, reply)

    def arrive(self, data: bytes, delay_s: float = 0.0) -> None:
        """See `_Wire.arrive`."""
        super().arrive(frame(data), delay_s)


class _Rig:
    """A link over a wire, and what reads through it."""

    def __init__(self, rng: Random) -> None:
        framed = rng.random() < 0.5
        self.wire = _FramedWire(rng) if framed else _Wire(rng)
        self.link = Link(_Stream(self.wire) if framed else self.wire, timeout_s=TIMEOUT_S)
        self.files = Files(self.link)
        self.files.write("a.bin", CONTENT)
        self.picture = read_display(self.link).tobytes()


def run(seed: int, numbers: range) -> Tally:
    """Tamper with the replies to these operations, each batch over a link of its own."""
    tally = Tally()
    rng = Random(f"{seed} {numbers.start // BATCH}")  # noqa: S311 - repeatable
    rig, before_kb = _Rig(rng), peak_memory_kb()
    for number in numbers:
        try:
            outcome = _transfer(rig, rng) if rng.random() < 0.1 else _request(rig, rng)
            _check_after(rig, outcome)
            if peak_memory_kb() - before_kb > MEMORY_LIMIT_KB:
                raise GuaranteeViolated("the batch needs more than 64 MB")
            tally.outcomes[outcome] += 1
        except Exception as error:  # noqa: BLE001 - that is what the campaign looks for
            tally.violations.append(Violation(number, repr(error)))
            rig, before_kb = _Rig(rng), peak_memory_kb()
    return tally


def _request(rig: _Rig, rng: Random) -> str:
    """Make one request whose reply is tampered with, and return the outcome."""
    wire, command = rig.wire, rng.choice(_REQUESTS)
    wire.fault = fault = rng.choice(wire.faults)
    begun = wire.now()
    try:
        reply = rig.link.request(command)
    except NXTError as error:
        outcome = f"{fault}: {type(error).__name__}"
    else:
        head = type(command).reply_head(command.encode())
        sound = [type(command).decode_reply(each) for each in wire.sound[head] if each.startswith(head)]
        outcome = f"{fault}: right value" if reply in sound else f"{fault}: changed value"
        echo = type(command).encode_reply(reply)[: len(head)]
        if outcome.endswith("changed value") and (fault not in (*CHANGES, *STREAMED[:2]) or echo != head):
            raise GuaranteeViolated(f"{command} gets the reply {reply} ({fault})")
    if (took_s := wire.now() - begun) > LIMIT_S:
        raise GuaranteeViolated(f"{command} took {took_s:.1f} s ({fault})")
    return outcome


def _transfer(rig: _Rig, rng: Random) -> str:
    """Read a file, the list of files or the display while some replies are tampered with, and return the outcome."""
    wire, begun = rig.wire, rig.wire.now()
    wire.rate = rng.choice((0.02, 0.1, 0.5))
    allowed = wire.faults
    wire.faults = tuple(fault for fault in allowed if fault in WHOLE)
    kind = rng.choice(("file", "list", "display"))
    try:
        if kind == "file":
            right = rig.files.read("a.bin") == CONTENT
        elif kind == "list":
            right = rig.files.ls() == LISTED
        else:
            right = read_display(rig.link).tobytes() == rig.picture
    except NXTError as error:
        outcome = f"{kind}: {type(error).__name__}"
    else:
        if not right:
            raise GuaranteeViolated(f"the {kind} is read wrong")
        outcome = f"{kind}: right"
    wire.rate, wire.faults = 0.0, allowed
    if (took_s := wire.now() - begun) > TRANSFER_LIMIT_S:
        raise GuaranteeViolated(f"the {kind} took {took_s:.1f} s")
    return outcome


def _check_after(rig: _Rig, outcome: str) -> None:
    """Check that the link answers the second request after the faults, and rightly."""
    tick = COMMAND.field("Tick")
    try:
        reply = rig.link.request(GetOutputState(OutputPort.B))
    except NXTError:
        reply = rig.link.request(GetOutputState(OutputPort.B))
    before = tick.decode(rig.link.request(tick.read()).data)
    after = tick.decode(rig.link.request(tick.read()).data)
    if reply.port is not OutputPort.B or not before < after:
        raise GuaranteeViolated(f"the link is out of step after {outcome}")
    for handle in range(HANDLES):  # those whose number was lost stay open
        rig.wire.brick.loader.close(handle)


def reply_head(telegram: bytes) -> bytes:
    """Return the first bytes of a valid reply to a request."""
    return COMMANDS[Kind(telegram[0]), telegram[1]].reply_head(telegram)


def _resized(rng: Random, reply: bytes) -> bytes:
    """Return a reply with other bytes after its header, where replies have their sizes."""
    changed = bytearray(reply)
    for at in range(REPLY_HEADER, min(len(reply), REPLY_HEADER + 6)):
        if rng.random() < 0.5:
            changed[at] = rng.choice((0, 1, 0x7F, 0xFF, rng.randrange(256)))
    return bytes(changed)


CAMPAIGN = Campaign(
    guarantee="No reply makes the driver fail: it returns a value of its request, a whole file, or an error of "
    "its own.",
    unit="operations",
    count=1_000_000,
    batch=BATCH,
    run=run,
)
