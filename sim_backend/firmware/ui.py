"""The user interface module as far as telegrams see it: battery, sleep timer, starting of programs, busy state.

Source: docs/firmware.md section 1, 5.2 (Ui map) and section 8.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware.battery import SAMPLE_MS, Battery, next_sample_ms
from sim_backend.firmware.io_control import POWER_DOWN, IoControl
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.names import NAME_SIZE, pack_name, unpack_name
from sim_backend.firmware.sound import SoundModule

MINUTE_MS = 60_000

_OPENING_MS = 7
"""Time from the request to the start command; a program is active 8 ms after its request."""

_MESSAGE_MS = 750
"""How long the display shows the end of a program."""

_PROGRAMS, _SOUND, _ON_BRICK = (".rxe", ".rtm"), ".rso", ".rpg"
_READER = pack_name("RPGReader.sys")
"""The program that interprets programs made on the brick itself."""

_EXIT_KEY = 4
_KEYS = ((1, _EXIT_KEY), (2, 3), (4, 1), (8, 2))
"""Bits of the button module (exit, right, left, enter), and their values in the map's Button."""


class UiState(IntEnum):
    """State byte of the map; the simulated states only."""

    WAITING = 7
    OPENING = 13
    RUNNING = 14
    LOW_BATTERY = 15


class Programs(Protocol):
    """The part of the command module that the user interface uses."""

    status: int

    @property
    def active(self) -> bool:
        """Whether a program is active."""

    def start(self, name: bytes) -> None:
        """Start a program in the next pass."""

    def stop(self) -> None:
        """Stop the program in the next pass."""


class UiModule:
    """Battery supervision, sleep timer, and the starting of files.

    Attributes:
        due_ms: See `Module`.
        battery: The supply.
        programs: The command module; set by the brick.
        flags: See `firmware_protocol.iomap.UiFlag`.
        state: See `UiState`.
        program_name: The file to start, 20 bytes.
        button: A button pressed through the map, 0 for none.
        sleep_minutes: Time until power-off, 0 for never.
        force_off: Nonzero to switch the brick off.
    """

    programs: Programs

    def __init__(self, clock: Clock, io_control: IoControl, sound: SoundModule) -> None:
        self._clock, self._io_control, self._sound = clock, io_control, sound
        self.due_ms = NEVER
        self.battery = Battery()
        self.sleep_minutes = 10
        self.flags = int(UiFlag.ENABLE_STATUS)
        self.state = int(UiState.WAITING)
        self.button = self.error = self.pointer = self.force_off = 0
        self.program_name = bytes(NAME_SIZE)
        self.run_state, self.bluetooth_state, self.usb_state = 1, 1, 2
        self._timer_started_ms = 0
        self._next_step_ms = NEVER
        self._warned = self._sound_is_file = False
        self._schedule()

    @property
    def sleep_timer(self) -> int:
        """Whole minutes since the timer was last reset."""
        return (self._clock.now_ms - self._timer_started_ms) // MINUTE_MS

    @property
    def sleep_ms(self) -> int:
        """Time until power-off in ms, 0 for never."""
        return self.sleep_minutes * MINUTE_MS

    def set_battery(self, raw: int) -> None:
        """Change the battery: a 10-bit converter value, plus `battery.RECHARGEABLE`."""
        self.battery.set(raw)
        self.due_ms = min(self.due_ms, next_sample_ms(self._clock.now_ms))

    def stay_awake(self) -> None:
        """Restart the sleep timer."""
        self._timer_started_ms = self._clock.now_ms
        self.due_ms = min(self.due_ms, self._clock.now_ms + 1)

    def set_sleep_minutes(self, minutes: int) -> None:
        """Change the time until power-off, 0 for never. The timer keeps running."""
        self.sleep_minutes = minutes
        self.wake()

    def execute(self, name: str) -> None:
        """Request the start of a file; the request is lost if the user interface is still busy."""
        self.program_name = pack_name(name)
        self.flags |= int(UiFlag.EXECUTE_FILE)
        self.wake()

    def press(self, buttons: int) -> None:
        """Handle buttons that were pressed, given as bits of the button module."""
        for bit, key in _KEYS:
            if buttons & bit:
                self.button = key
        self.wake()

    def wake(self) -> None:
        """Run in the next pass."""
        self.due_ms = self._clock.now_ms + 1

    def program_ended(self) -> None:
        """Show the end of a program from this pass on."""
        if self.state == UiState.RUNNING:
            self._next_step_ms = self._clock.now_ms + _MESSAGE_MS
            self.due_ms = self._clock.now_ms

    def run(self, now_ms: int) -> None:
        """Run one pass: battery, keys, files, supply."""
        if now_ms % SAMPLE_MS == 0:
            self.battery.sample()
        if self.flags & UiFlag.RESET_SLEEP_TIMER:
            self.flags &= ~int(UiFlag.RESET_SLEEP_TIMER)
            self._timer_started_ms = now_ms
        if self.button:
            self._take_key()
        self._step(now_ms)
        self._watch_supply()
        self._schedule()

    def _take_key(self) -> None:
        key, self.button = self.button, 0
        self._timer_started_ms = self._clock.now_ms
        if self.state == UiState.LOW_BATTERY:
            self._become_idle()
        elif key == _EXIT_KEY and self._can_be_stopped:
            self.programs.stop()

    @property
    def _can_be_stopped(self) -> bool:
        """Whether the exit button stops the program."""
        running = self.state == UiState.RUNNING and self.programs.active
        return running and not self.flags & UiFlag.DISABLE_EXIT

    def _step(self, now_ms: int) -> None:
        """Continue to start or end a file."""
        if self.state == UiState.WAITING and self.flags & UiFlag.EXECUTE_FILE:
            self.flags = self.flags & ~int(UiFlag.EXECUTE_FILE) | int(UiFlag.BUSY)
            self.state, self._next_step_ms = int(UiState.OPENING), now_ms + _OPENING_MS
            self._timer_started_ms = now_ms
        elif self.state == UiState.OPENING and now_ms >= self._next_step_ms:
            self._open(now_ms)
        elif self.state == UiState.RUNNING and now_ms >= self._next_step_ms:
            if self._sound_is_file and self._sound.playing:
                self._next_step_ms = now_ms + 1
                return
            self._become_idle()

    def _open(self, now_ms: int) -> None:
        """Start a file by its extension; with an unknown one the user interface hangs, as the firmware's does."""
        self._next_step_ms = NEVER
        name = unpack_name(self.program_name)
        extension = name[name.rfind(".") :].lower() if "." in name else ""
        self._sound_is_file = extension == _SOUND
        if extension in _PROGRAMS or extension == _ON_BRICK:
            self.state = int(UiState.RUNNING)
            self.programs.start(self.program_name if extension in _PROGRAMS else _READER)
        elif extension == _SOUND:
            self.state, self._next_step_ms = int(UiState.RUNNING), now_ms + 2
            self._sound.play_file(name, loop=False)

    def _become_idle(self) -> None:
        """Accept buttons and requests again; a request made meanwhile is lost."""
        self.flags &= ~int(UiFlag.BUSY | UiFlag.EXECUTE_FILE)
        self.state, self._next_step_ms = int(UiState.WAITING), NEVER
        if not self.programs.active:
            self.programs.status = int(ProgramStatus.IDLE)

    def _watch_supply(self) -> None:
        """Warn of a low battery once; switch off when the sleep timer has expired."""
        self._warned = self._warned and self.battery.low
        if self.battery.low and not self._warned and self.state == UiState.WAITING:
            self._warned = True
            self.flags |= int(UiFlag.BUSY)
            self.state = int(UiState.LOW_BATTERY)
        if self.sleep_minutes and self.sleep_timer >= self.sleep_minutes:
            self.force_off = 1
        if self.force_off and not self._io_control.power_word:
            if self.programs.active:
                self.programs.stop()
            self._io_control.shut_down(POWER_DOWN)

    def _schedule(self) -> None:
        now_ms, due = self._clock.now_ms, self._next_step_ms
        if self.sleep_minutes and not self.force_off:
            due = min(due, self._timer_started_ms + self.sleep_ms)
        if not self.battery.settled:
            due = min(due, next_sample_ms(now_ms))
        self.due_ms = max(due, now_ms + 1)
