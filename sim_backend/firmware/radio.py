"""The Bluetooth radio as telegrams see it: name, address, power, and how long it is busy.

Source: docs/firmware.md section 10. The durations are those of the bench's radio.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from operator import itemgetter

from sim_backend.firmware import radio_answers as answers
from sim_backend.firmware.limits import BLUETOOTH
from sim_backend.firmware.module import Clock
from sim_backend.firmware.radio_answers import NAME_AT_BOOT, NAME_SIZE, Change, Part, RadioState, padded, shifted
from sim_backend.firmware.radio_line import PLACE_WITH_RADIO_OFF, RING, STARTS_AGAIN_MS, UNENDING_MS, RadioLine
from sim_backend.firmware.radio_operation import SILENT_MS, STREAM_ENDS_MS, TIME_OUT_MS, Held, Operation
from sim_backend.firmware.radio_tables import RadioTables
from sim_backend.firmware.settled import Settled

DEFAULT_NAME = b"NXT"

_ADDRESS_SIZE = 6

_OF_THE_RADIO = (Part.MESSAGE, Part.ON, Part.STORED_NAME)
"""Changes that come although the firmware does not recognise an answer."""


class Radio:
    """Identity and state of the radio.

    Raises:
        ValueError: Name or address has another size.

    Attributes:
        own_address: Six bytes.
        address: The firmware's copy of the address.
        name: The brick's name: 16 bytes, zero-padded.
        stored_name: The name that other devices see and that is kept without power: 16 bytes, zero-padded.
        state: The state that the user interface shows: a `RadioState`, or what was written to its map.
        resetting: 1 while the radio starts again after a reset, or what was written to its map.
        link_state: State of the radio in the Comm map: its bits 0 and 1 are set once the radio was on.
        line: What brings the radio's answers, and other bytes.
        on_plan: Called when an operation begins or continues; set by the brick.
        tables: The tables of the Comm map; set by the brick.
        inbox: The receive buffer of the Comm map, which the answers enter; set by the brick.
        sending: Whether a program has sent something; to nowhere, since nothing is connected.
        sends_reply: Whether a long reply is being sent, in which no operation begins; set by the brick.
    """

    name, stored_name = Settled[bytes](), Settled[bytes]()
    state, resetting, link_state = Settled[int](), Settled[int](), Settled[int]()

    on_plan: Callable[[], None]
    tables: RadioTables
    inbox: memoryview
    sends_reply: Callable[[], bool]

    def __init__(self, clock: Clock, name: bytes, address: bytes) -> None:
        if len(name) >= NAME_SIZE or len(address) != _ADDRESS_SIZE:
            sizes = f"at most {NAME_SIZE - 1} characters and {_ADDRESS_SIZE} bytes"
            raise ValueError(f"name and address must have {sizes}, not {name!r} and {address!r}")
        self._clock = clock
        self.own_address = self.address = address
        self._name = self._stored_name = padded(name)
        self._on, self._resetting = True, 0
        self._state = int(RadioState.VISIBLE)
        self._busy_from_ms, self._busy_until_ms = 0, 0.0
        self._link_state = answers.LINKED
        self._changes: list[Change] = []
        self._waited = self._redraws = False
        self._operation: Operation | None = None
        self._is_lost = self._is_silent = self.sending = False
        self.line = RadioLine(self.hear)
        self._held: Held | None = None

    def set_streaming(self, streaming: bool) -> None:
        """Begin or end stream mode; a command waits until it has ended."""
        self.settle()
        self.line.streaming = streaming
        self._is_lost |= self._held is not None and self._busy_until_ms < UNENDING_MS
        if self._clock.now_ms < self._busy_from_ms:  # it is over when the mode has changed
            self._busy_until_ms, self._operation = 0, None
        operation = self._operation
        next_ms = next((change.at_ms for change in self._changes if change.part is Part.ANSWER), None)
        if operation and streaming and self._on and not self._waited and next_ms is not None:
            self._changes = [change for change in self._changes if change.at_ms < next_ms]
            self._busy_until_ms, self._is_lost = next_ms + TIME_OUT_MS, True
        elif operation and not streaming and self._busy_until_ms == inf:
            self._continue(operation)
        elif operation and streaming and self._waited and self._clock.now_ms < operation.over_ms:
            self._hold()

    @property
    def is_on(self) -> bool:
        """Whether the radio is on; otherwise there is no stream."""
        self.settle()
        return self._on

    @property
    def shown_state(self) -> int:
        """The state for the user interface: changes come after its step of a pass."""
        return self._state

    @property
    def shows_off(self) -> bool:
        """Whether the state says that it is off, which the map can overwrite."""
        return bool(self.state & RadioState.OFF)

    @property
    def awaits_lost_answer(self) -> bool:
        """Whether the firmware waits for an answer that stream mode or other bytes have lost."""
        return self.operating and self._is_lost

    @property
    def received(self) -> bytes:
        """The receive buffer of the Comm map."""
        self.settle()
        return bytes(self.inbox[: BLUETOOTH.buffer])

    @property
    def next_redraw_ms(self) -> float:
        """Time of the next answer that redraws the status bar."""
        return min((change.at_ms for change in self._changes if change.part is Part.REDRAWS), default=inf)

    def redraws(self, at_ms: int) -> bool:
        """Return whether a command to the radio, or one of its answers by that time, redraws the status bar."""
        return self._redraws or self.next_redraw_ms <= at_ms

    def follow(self, until_ms: int) -> bool:
        """Make the changes up to that time; return whether the status bar is to be redrawn."""
        self.settle(until_ms)
        redraws, self._redraws = self._redraws, False
        return redraws

    @property
    def busy(self) -> bool:
        """Whether an operation is running, or a long reply is being sent; no operation can start."""
        return self._busy(self._clock.now_ms)

    @property
    def operating(self) -> bool:
        """Whether an operation is running."""
        return self._busy_from_ms <= self._clock.now_ms < self._busy_until_ms

    @property
    def seems_busy(self) -> bool:
        """The same for the user interface, which runs before the radio in a pass."""
        return self._busy(self._clock.now_ms - 1)

    def _busy(self, at_ms: int) -> bool:
        return self._busy_from_ms <= at_ms < self._busy_until_ms or self.sends_reply()

    def start_from(self, before: Radio) -> None:
        """Start as the radio of the same brick before a power cycle."""
        self._stored_name = before.stored_name
        self._name = padded(self._stored_name[:NAME_AT_BOOT])
        if not before._on:
            self._on, self._state = False, RadioState.OFF
            self.line.place, self._link_state = PLACE_WITH_RADIO_OFF, 0

    def show_boot(self) -> None:
        """Show the last answers of the boot in the receive buffer."""
        self.inbox[:NAME_SIZE] = bytes(NAME_SIZE)
        for answer in (answers.name_answer(self._stored_name), answers.IS_ON if self._on else answers.IS_OFF):
            self._enter(answer)

    def _enter(self, message: bytes) -> None:
        """Leave a message in the receive buffer."""
        self.inbox[: len(message)] = answers.received(message)

    def rename(self, name: bytes) -> None:
        """Change the name, at most 15 characters, after a start of the radio if its state, as in the map, is off."""
        starts = self.shows_off
        self.name, self._redraws = padded(name), True
        if starts or self._on:
            at_ms, woken = (158, answers.woken(154)) if starts else (4, [])
            self._occupy(at_ms, *woken, *answers.renamed(at_ms, self._name), late_ms=1, stream_lasts_ms=3)
        else:
            self._occupy(SILENT_MS - 1, Change(4, Part.STORED_NAME, self._name), late_ms=1, stream_lasts_ms=3)

    def switch(self, on: bool, *, lead_ms: int = 0) -> bool:
        """Switch the radio on or off; False if it is busy, or on already by its state, which the map can overwrite.

        Args:
            on: Whether to switch it on.
            lead_ms: How much earlier the command reaches the radio than that of a telegram.
        """
        self.settle()
        if self.busy or (on and not self.shows_off):
            return False
        if on:
            self._state = int(RadioState.OFF)
            self._occupy(
                163,
                *self._started(154, self._stored_name, on_ms=162, last_ms=163),
                lead_ms=lead_ms,
                stream_lasts_ms=inf,
            )
        else:
            answer = answers.SWITCHED_OFF if self._on else b""
            off = [Change(5, Part.ANSWER, answer), Change(5, Part.ON, False)]
            if self._on:
                off += Change(5, Part.STATE, RadioState.OFF), Change(5, Part.REDRAWS)
            duration = 5 if self._on else SILENT_MS + (0 if self._is_silent else STREAM_ENDS_MS)
            self._occupy(duration, *off, answer_ms=5, late_ms=1, lead_ms=lead_ms, ends_ms=4)
            self._is_silent = not self._on
        return True

    def begin(self, duration_ms: int, *changes: Change) -> bool:
        """Begin another operation; False if the radio is busy."""
        self.settle()
        if self.busy:
            return False
        self._occupy(duration_ms, *changes, answer_ms=3)
        return True

    def disconnect(self) -> bool:
        """End all connections, as before the power goes off, which takes longer if the radio is off; False if busy."""
        self.settle()
        if self.seems_busy:
            return False
        duration = self._disconnects_ms(3)
        self._occupy(duration, Change(duration, Part.ANSWER, b""), answer_ms=5, late_ms=1, ends_ms=3)
        self._is_silent = not self._on
        return True

    def _disconnects_ms(self, duration_ms: int) -> int:
        return duration_ms if self._on or self._is_silent else duration_ms + STREAM_ENDS_MS

    def end_sending(self) -> None:
        """At the end of a program that has sent something, end a stream in the second pass after this one."""
        self.settle()
        if self.sending and not self.busy:
            self._occupy(self._disconnects_ms(1), answer_ms=5, lead_ms=-2, stream_lasts_ms=0)
            self._is_silent = not self._on
        self.sending = False

    @property
    def stream_ends_ms(self) -> float:
        """The pass from which on the telegrams of a stream are lost, if an operation waits for the end of stream mode.

        It waits from the pass before it begins on.
        """
        operation = self._operation
        if operation is None or self._busy_until_ms < inf or self._clock.now_ms < operation.began_ms - 1:
            return inf
        return operation.began_ms + operation.stream_lasts_ms

    @property
    def leaves_ms(self) -> float:
        """When the firmware leaves stream mode, at the earliest, after a command that waits for that."""
        return self._operation.leaves_ms if self._operation and self._waited else 0

    def reset(self) -> None:
        """Restore the default name, and switch the radio on."""
        self.settle()
        off = self.shows_off
        wait, woken = (154, answers.woken(154)) if off else (0, [])
        on_ms = 168 + wait
        name = padded(DEFAULT_NAME)
        self._occupy(
            on_ms + 1,
            *woken,
            *answers.restored(6 + wait, name),
            *self._started(160 + wait, name, on_ms=on_ms, last_ms=on_ms + 1, reset=True),
            answer_ms=5,
            stream_lasts_ms=2,
            ends_ms=5 + wait,
        )

    def hear(self, at_ms: int, message: bytes) -> None:
        """Take a message from the line: the answer for which an operation waits, or another; then it waits for ever."""
        held = self._held if at_ms < self._busy_until_ms else None
        if held is None or message != held.answer.value:
            self._add(Change(at_ms, Part.MESSAGE, message))
            self._busy_until_ms += UNENDING_MS if held else 0
            return
        self._held, late_ms = None, at_ms - held.answer.at_ms
        self._busy_until_ms = held.busy_until_ms + late_ms
        self._add(Change(at_ms, Part.MESSAGE, message), *shifted(held.changes, late_ms))
        self.on_plan()

    def _add(self, *changes: Change) -> None:
        self._changes = sorted([*self._changes, *changes], key=itemgetter(0))

    def _divert(self, answer: Change) -> None:
        """Let an answer wait behind other bytes on the line, and the operation for the answer."""
        changes = [change for change in self._changes if change.part not in _OF_THE_RADIO]
        self._changes = [change for change in self._changes if change.part in _OF_THE_RADIO]
        if answer.value == answers.WOKEN:
            self._add(*shifted((answer._replace(part=Part.FRESH_LINE), answer, *changes), STARTS_AGAIN_MS))
            self._busy_until_ms += STARTS_AGAIN_MS
        else:
            self._held = Held(answer, changes, self._busy_until_ms)
            self._busy_until_ms = answer.at_ms + answers.lost_ms(answer.value)
        self.on_plan()

    def postpone(self, passes: int) -> None:
        """Delay the effects of an operation: the radio does not run for the next passes."""
        self.settle()
        self._busy_until_ms += 0 if self._held else passes
        self._changes = shifted(self._changes, passes)
        self.on_plan()
        if self._operation is not None:
            self._operation = self._operation._replace(began_ms=self._operation.began_ms + passes)

    def _occupy(
        self,
        duration_ms: int,
        *changes: Change,
        answer_ms: int = 4,
        late_ms: int = 0,
        lead_ms: int = 0,
        stream_lasts_ms: float = 1,
        ends_ms: int = 0,
    ) -> None:
        handles = self.tables.handles if ends_ms and self._on else ()  # connections end first
        in_order = sorted(answers.after_ends(changes, handles, ends_ms, self.tables.end), key=itemgetter(0))
        duration_ms += answers.END_MS * len(handles)
        began_ms = self._clock.now_ms - lead_ms
        self._busy_from_ms = began_ms if lead_ms < 0 else 0
        self._operation = operation = Operation(
            began_ms, answer_ms, late_ms, duration_ms, tuple(in_order), stream_lasts_ms
        )
        self._is_silent = self._is_lost = False
        self._waited, self._held = self.line.streaming, None
        self.on_plan()
        if self.line.streaming:
            self._hold()
        else:
            self._schedule(operation, 0, 0)

    def _started(self, at_ms: int, name: bytes, *, on_ms: int, last_ms: int, reset: bool = False) -> list[Change]:
        """Return the changes of a start of the radio."""
        started = answers.started(at_ms, name, self.own_address, on_ms=on_ms, last_ms=last_ms, reset=reset)
        return [*started, Change(at_ms, Part.TABLES, self.tables.clear)]

    def _hold(self) -> None:
        self._changes, self._busy_until_ms = [], inf

    def _continue(self, operation: Operation) -> None:
        """Continue an operation as the radio leaves stream mode."""
        passed_ms = self._clock.now_ms - operation.began_ms
        late_ms = operation.late_ms if passed_ms >= STREAM_ENDS_MS else 0
        self._schedule(operation, max(STREAM_ENDS_MS, passed_ms) - operation.answer_ms, late_ms)

    def _schedule(self, operation: Operation, shift_ms: int, late_ms: int) -> None:
        self.settle()
        began_ms, place = operation.began_ms + shift_ms, self.line.place
        changes: list[Change] = []
        for at_ms, part, value in operation.changes:
            if part is Part.ANSWER:
                began_ms += place % RING + len(value) > RING  # the firmware reads up to the end of the ring in a pass
                place += len(value)
            changes.append(Change(began_ms + at_ms + (0 if part is Part.STORED_NAME else late_ms), part, value))
        self._changes = sorted(changes, key=itemgetter(0))
        self._busy_until_ms = began_ms + operation.duration_ms + late_ms
        self.on_plan()

    def settle(self, until_ms: int | None = None) -> None:
        """Make the changes whose time has come."""
        until_ms = self._clock.now_ms if until_ms is None else until_ms
        while self._changes and self._changes[0].at_ms <= until_ms:
            match change := self._changes.pop(0):
                case at_ms, Part.ANSWER, answer if answer and self.line.is_obstructed(at_ms):
                    if answer != answers.SEARCHES:
                        self._divert(change)
                    self.line.append(at_ms, answer)
                case _, Part.ANSWER, answer:
                    self._enter(answer)
                    self.line.place += len(answer)
                case _, Part.MESSAGE, message:
                    self._enter(message)
                case _, Part.NAME, name:
                    self._name = name[:NAME_AT_BOOT] + self._name[NAME_AT_BOOT:]
                case _, Part.STORED_NAME, name:
                    self._stored_name = name
                case _, Part.ON, on:
                    self._on = bool(on)
                case _, Part.STATE, state:
                    self._state = state if state == RadioState.OFF else self._state & ~answers.CLEARED | state
                case _, Part.VISIBLE, visible:
                    self._state, self._link_state = (
                        self._state & ~1 | bool(visible),
                        self._link_state & ~1 | bool(visible),
                    )
                case _, Part.LINK_STATE, bits:
                    self._link_state |= bits
                case _, Part.RESETTING, resetting:
                    self._resetting = resetting
                case _, Part.REDRAWS, _:
                    self._redraws = True
                case at_ms, Part.FRESH_LINE, _:
                    self.line.clear(at_ms)
                case _, Part.TABLES, call:
                    call()
