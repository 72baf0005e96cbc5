"""How the user interface runs a file: a program or a sound, and the message about its end.

Source: docs/firmware.md section 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from firmware_protocol.iomap import ProgramStatus, UiFlag
from sim_backend.firmware.files.names import extension, pack_name
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui import times
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.menu_items import Call
from sim_backend.firmware.ui.program_steps import ProgramSteps
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.running_sign import RunningSign
from sim_backend.firmware.ui.states import Programs, UiState
from sim_backend.firmware.ui.text_entry import TextEntry


class _Step(IntEnum):
    """Steps of a file; after the first three they are those of its kind, and all others show the message."""

    BEGUN = 0
    WAITING = 1
    DRAWING = 2
    SOUND = 10
    PLAYING = 11
    PROGRAM = 20
    RUNNING = 21
    ON_BRICK = 30
    READING = 31
    ENDED = 99
    MESSAGE = 100


class FileRunner:
    """The state RUNNING, and the function RUN.

    Args:
        types: The extension of each kind of files.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        screen: ScreenRefresh,
        sound: SoundModule,
        programs: Programs,
        steps: ProgramSteps,
        text: TextEntry,
        running: RunningSign,
        types: Sequence[str],
    ) -> None:
        self._registers, self._keys, self._screen, self._sound = registers, keys, screen, sound
        self._programs, self._steps, self._text, self._running = programs, steps, text, running
        kinds = (0, _Step.SOUND, _Step.PROGRAM, _Step.ON_BRICK, _Step.PROGRAM, _Step.MESSAGE)
        self._first_steps = dict(zip(types, kinds, strict=True))

    def state(self) -> None:
        """Run the requested file; then the menus draw its page, and a request made meanwhile is lost."""
        if not self.run(Call.RUN):
            self._registers.clear(UiFlag.EXECUTE_FILE)
            self._registers.go_to(UiState.MENU)

    def run(self, argument: int) -> bool:
        """Draw the name of a file, or run it; return whether it goes on."""
        if argument == Call.RUN:
            self._registers.timer.count(limit=times.MESSAGE_PASSES)
            self._go_on()
        else:
            self._screen.mark(marks.FILE_NAME)
        return bool(self._registers.step)

    def _go_on(self) -> None:
        registers, screen, sound, name = self._registers, self._screen, self._sound, self._registers.selected
        match registers.step:
            case _Step.BEGUN:
                registers.set(UiFlag.BUSY)
                registers.step = _Step.WAITING
            case _Step.WAITING if not sound.state:
                screen.mark(marks.NAMES)
                self._running.begin()
                registers.step = _Step.DRAWING
            case _Step.DRAWING if not screen.drawing:  # an unknown kind leaves the user interface busy forever
                registers.step = self._first_steps.get(extension(pack_name(name)), 0)
            case _Step.SOUND:
                packed = pack_name(name)
                sound.play_own(packed[: packed.index(0) + 1], registers.volume)
                registers.step = _Step.PLAYING
            case _Step.PLAYING:
                self._play()
            case _Step.PROGRAM if not (screen.erase_mask or self._programs.status or self._keys.enter_acts):
                self._programs.start(pack_name(name))
                registers.step = _Step.RUNNING
            case _Step.RUNNING:
                self._follow_program()
            case _Step.ON_BRICK:
                self._text.step = 0
                known = self._steps.open(name)
                if known:
                    screen.mark(marks.OPENS_STEPS)
                registers.step = _Step.READING if known else _Step.ENDED
            case _Step.READING:  # with the step of an entered text instead of this one
                registers.step = self._text.step
                goes_on = self._steps.run(Call.RUN)
                self._text.step, registers.step = registers.step, _Step.READING if goes_on else _Step.ENDED
            case _Step.ENDED:
                screen.mark(marks.ENDED)
                registers.set(UiFlag.ENABLE_STATUS | UiFlag.REDRAW_STATUS)
                registers.timer.value, registers.step = 0, _Step.MESSAGE
            case _Step.WAITING | _Step.DRAWING | _Step.PROGRAM:
                pass
            case _:
                self._show_message()

    def _play(self) -> None:
        """Wait for the end of the sound, or for exit."""
        self._running.turn()
        self._registers.rest(1)
        if not self._sound.state:
            self._registers.step = _Step.ENDED
        if self._keys.read() == Key.EXIT:
            self._sound.cancel()
            self._registers.step = _Step.ENDED

    def _follow_program(self) -> None:
        """Wait for the end of the program."""
        registers = self._registers
        self._running.turn()
        if registers.flags & UiFlag.REDRAW_STATUS and registers.flags & UiFlag.ENABLE_STATUS:
            self._screen.mark(marks.NAMES)
        if self._programs.status != ProgramStatus.RUNNING:
            registers.rest(1)
            registers.step = _Step.ENDED

    def _show_message(self) -> None:
        """End the message when its time is over, or by a key; then accept requests again."""
        registers = self._registers
        left = times.MESSAGE_PASSES - registers.timer.count()
        if left > 0 and not self._keys.read():
            registers.rest((left + 1) // 2)  # each pass counts twice
            return
        if self._programs.status:
            self._programs.reset()
        self._running.end()
        self._screen.mark(marks.CLOSING)
        registers.clear(UiFlag.BUSY)
        registers.step = 0
