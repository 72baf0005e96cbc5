"""The program of five steps that is made, run and saved on the brick. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.iomap import ProgramStatus
from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import pack_name
from sim_backend.firmware.module import Clock
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import message
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.menu_items import STEPS, Call
from sim_backend.firmware.ui.menu_place import MenuPlace
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.running_sign import RunningSign
from sim_backend.firmware.ui.states import Programs, UiState
from sim_backend.firmware.ui.text_entry import TextEntry

_STEPS = len(STEPS)
_EMPTY = 0x21
"""A step without a choice."""
_ICONS = {code: code & 0x0F for code in range(0x21, 0x30)} | {code: code - 0x30 for code in range(0x41, 0x4A)}
_ICONS |= {0xFC: 0x1F, 0xFB: 0x20}
"""Icons of the steps as the file has them; another code leaves the icon that was there."""

_READER = "RPGReader.sys"
"""The file that runs it."""
_FILE, _SAVED, _OFFERED = "Program.tmp", ".rpg", "Untitled"
"""Name of the file of the program, the end of its name when it is saved, and the name that is offered."""
_HEADER = bytes((8, 0, 0, _STEPS, _STEPS, 0, 0, 0))
_CHECKED = 2
"""Bytes of the header that a program to run must have."""

_LEAVES = 99
"""Step that leaves the program's menu, or the program that runs."""
_REDRAWN_PASSES = 50
"""How long the steps stay before they show that another one runs."""


class ProgramSteps:
    """The function PROGRAM.

    Attributes:
        icons: The icon of each step, as the display's map has them.
    """

    def __init__(
        self,
        clock: Clock,
        registers: UiRegisters,
        loader: Loader,
        programs: Programs,
        screen: ScreenRefresh,
        sound: SoundModule,
        place: MenuPlace,
        shown: Message,
        text: TextEntry,
        running: RunningSign,
    ) -> None:
        self._clock, self._registers, self._loader, self._programs = clock, registers, loader, programs
        self._screen, self._sound, self._place = screen, sound, place
        self._message, self._text, self._running = shown, text, running
        self.icons, self._codes, self._turn = bytes(_STEPS), bytes(_STEPS), 0
        self._content, self._drawn_ms = b"", 0

    def run(self, argument: int) -> bool:
        """Run a pass."""
        registers = self._registers
        match argument:
            case Call.OPEN:
                self._screen.mark(marks.TYPES)
                registers.go_to(UiState.WAITING)
            case Call.TEXT:
                self._codes, self._turn = bytes([_EMPTY] * _STEPS), 0
                self._screen.mark(marks.ERASED_MENU)
                self._draw()
            case Call.EXIT:
                self._go_back()
            case Call.RUN:
                self._execute()
            case Call.SAVE:
                self._save()
            case Call.LEFT | Call.RIGHT:
                registers.go_to(UiState.WAITING)
            case _:
                self._choose(argument)
        return bool(registers.step)

    def _draw(self) -> None:
        """Draw the steps, and the cursor below the step whose turn it is."""
        self._drawn_ms, self._registers.picture = self._clock.now_ms, _STEPS
        steps = zip(self._codes, self.icons, strict=True)
        self.icons = bytes(_ICONS.get(code, icon) for code, icon in steps)
        self._screen.mark(marks.STEPS)
        if self._turn < _STEPS:
            self._screen.mark(marks.CURSOR)
        if self._programs.status != ProgramStatus.RUNNING:
            self._screen.mark(marks.STEPS_TEXT)

    def _go_back(self) -> None:
        """Forget the choice of a step, and turn to the one before; the first one leads to the page before."""
        if self._turn:
            if self._turn < _STEPS:
                self._set_step(_EMPTY)
            self._turn -= 1
        else:
            self._registers.go_to(UiState.MENU)
        self._draw()

    def _set_step(self, code: int) -> None:
        self._codes = self._codes[: self._turn] + bytes([code]) + self._codes[self._turn + 1 :]

    def _choose(self, code: int) -> None:
        """Choose a step; the last one stores the program. After it the code overwrites the number of the step."""
        registers = self._registers
        if registers.step:
            if self._message.show(12, passes=message.LONG):
                self._leave()
            return
        if self._turn == _STEPS:
            self._turn = code
        elif self._turn < _STEPS:
            self._set_step(code)
            self._turn += 1
            if self._turn == _STEPS and not self._store(_HEADER + self._codes):
                registers.step = 1
        self._draw()

    def _store(self, content: bytes) -> bool:
        """Store the program in place of the one before; return whether there is room."""
        self._content = content
        return self._loader.replace(_FILE, content)

    def _leave(self) -> None:
        """Go to the menu before this one."""
        self._place.leave()
        self._registers.end(UiState.MENU)

    def open(self, name: str) -> bool:
        """Copy a program to run, as if it had been made here; return whether it is one.

        A file that cannot be opened leaves the last program.
        """
        loader, content = self._loader, self._content
        status, handle, _ = loader.open_read(name)
        if not status:
            _, content = loader.read(handle, len(_HEADER) + _STEPS)
            loader.close(handle)
        if content[:_CHECKED] != _HEADER[:_CHECKED] or len(content) < len(_HEADER) + _STEPS:
            return False
        self._store(content)
        self._codes = content[len(_HEADER) :]
        return True

    def _execute(self) -> None:
        """Run the program by the file that can, if it exists."""
        registers, programs = self._registers, self._programs
        draws = registers.step not in (1, 2, 3)
        match registers.step:
            case 0:
                self._running.begin()
                registers.step = 1
            case 1 if not self._sound.state:
                self._turn = _STEPS
                self._screen.mark(marks.NO_NAME)
                registers.step = 2
            case 2 if programs.status == ProgramStatus.IDLE:
                programs.start(pack_name(_READER))
                registers.step = 3
            case 3 if programs.status != ProgramStatus.RUNNING:
                programs.reset()
                registers.step, self._turn = _LEAVES, _STEPS
            case 3 if self._clock.now_ms - self._drawn_ms >= _REDRAWN_PASSES and registers.pointer != self._turn:
                self._turn, draws = registers.pointer, True
            case 1 | 2 | 3:
                pass
            case _:
                registers.step = 0
        if registers.step:
            self._running.turn()
            registers.rest(1)
        else:
            self._running.end()
        if draws:
            self._draw()

    def _save(self) -> None:
        """Ask for a name, and rename the program."""
        registers, text = self._registers, self._text
        match registers.step:
            case 0:
                text.text = _OFFERED
                registers.step = 1
            case 1 if text.run():
                registers.step = _LEAVES
                if text.text:
                    registers.selected = text.text + _SAVED
                    registers.step = 2 if self._exists(registers.selected) else 3
            case 2 if self._message.show(11, 10):
                registers.step = 0
            case 3:
                self._loader.rename(_FILE, registers.selected)
                registers.step = 4
            case 4 if self._message.show(10, passes=message.SHORT):
                registers.step = 5
            case 1 | 2 | 4:
                pass
            case _:
                self._leave()

    def _exists(self, name: str) -> bool:
        status, handle, _ = self._loader.find_first(name)
        if status == Status.OK:
            self._loader.close(handle)
        return status == Status.OK
