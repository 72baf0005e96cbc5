"""The lists of files of the menus, and what their items do with a file. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import message
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.menu_items import Call, Function
from sim_backend.firmware.ui.menu_place import neighbour
from sim_backend.firmware.ui.message import Message
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.states import UiState


class FileSearch:
    """Finds files, one in each pass, with a step that only its end and state 13 reset.

    Attributes:
        step: 0 if it begins with the next pass, 1 if it goes on.
    """

    def __init__(self, loader: Loader) -> None:
        self._loader, self._handle, self.step, self._found = loader, 0, 0, 0

    def count(self, pattern: str, files: int) -> tuple[bool, int]:
        """Count the files that match; return whether it is over, and the count."""
        if self.step:
            status, *_ = self._loader.find_next(self._handle)
            if not status:
                return False, files + 1 & 0xFF
            self._loader.close(self._handle)
            self.step = 0
            return True, files
        status, self._handle, _ = self._loader.find_first(pattern)
        self.step = int(not status)
        return bool(status), int(not status)

    def find(self, pattern: str, number: int, name: str) -> tuple[bool, str]:
        """Look for a file by its number, from 1 on; return whether it is over, and the name that was found last."""
        if not number:
            return True, ""
        if self.step:
            status, _, file = self._loader.find_next(self._handle)
            self._found += 1
        else:
            status, self._handle, file = self._loader.find_first(pattern)
            self._found, name = 1, ""
            if status:
                return True, name
        self.step = int(not status and self._found != number)
        if not self.step:
            self._loader.close(self._handle)
        return not self.step, file.name if file else name


class FileList:
    """The functions LIST, DELETE and ERASE.

    Args:
        types: The extension of each kind of files.
    """

    def __init__(
        self,
        registers: UiRegisters,
        loader: Loader,
        screen: ScreenRefresh,
        sound: SoundModule,
        shown: Message,
        search: FileSearch,
        types: Sequence[str],
    ) -> None:
        self._registers, self._loader, self._screen, self._sound = registers, loader, screen, sound
        self._message, self._search, self._types = shown, search, types
        self._kind, self._chosen, self._files, self._next_state = 0, 0, 0, int(UiState.START)
        self._erased = 0

    @property
    def functions(self) -> Mapping[Function, Callable[[int], bool]]:
        """The functions of items."""
        return {
            Function.LIST: self.list,
            Function.DELETE: self.delete,
            Function.ERASE: self.erase,
        }

    def open_programs(self) -> None:
        """List programs from now on: one was opened."""
        self._kind = self._types.index(".rxe")

    def list(self, argument: int) -> bool:
        """Draw a list from its first file on, or after left or right."""
        registers = self._registers
        if argument == Call.SELECT:
            return bool(registers.step)
        if not registers.step:
            self._next_state = UiState.WAITING
            if argument in (Call.LEFT, Call.RIGHT):
                self._chosen = neighbour(self._chosen, argument, self._files)
            else:
                self._kind = argument or self._kind
                self._chosen, self._next_state = 1, registers.state
        self._draw()
        return bool(registers.step)

    def _draw(self) -> None:
        registers, pattern = self._registers, "*" + self._types[self._kind]
        match registers.step:
            case 0:
                self._search.step, registers.step = 0, 1
            case 1:
                over, self._files = self._search.count(pattern, self._files)
                if over and not self._files:
                    registers.end(UiState.EXIT)
                elif over:
                    registers.step = 2
            case 2:
                over, registers.selected = self._search.find(pattern, self._chosen, registers.selected)
                if over:
                    registers.step = 3
            case _:
                self._screen.mark(marks.listed(self._files, self._chosen))
                registers.end(self._next_state)

    def delete(self, argument: int) -> bool:
        """Delete the chosen file when no sound plays, and show that."""
        registers = self._registers
        match registers.step:
            case _ if argument != Call.OPEN:
                pass
            case 1 if self._sound.state:
                pass
            case 0 | 1:
                registers.step += 1
            case 2:
                self._loader.delete(registers.selected)
                registers.step = 3
            case _ if self._message.show(12, passes=message.SHORT):
                registers.end(UiState.EXIT)
        return bool(registers.step)

    def erase(self, argument: int) -> bool:
        """Ask whether to delete all files of a kind, or delete them when no sound plays, one in each pass."""
        registers = self._registers
        if argument == Call.OPEN:
            self._screen.mark(marks.READY)
            registers.go_to(UiState.WAITING)
        elif argument == Call.DELETE:
            self._erase()
        else:
            self._erased = argument
        return bool(registers.step)

    def _erase(self) -> None:
        registers = self._registers
        match registers.step:
            case 1 if self._sound.state:
                pass
            case 0 | 1:
                registers.step += 1
            case 2:
                status, handle, file = self._loader.find_first("*" + self._types[self._erased])
                if status == Status.OK and file:
                    registers.selected = file.name
                    self._loader.close(handle)
                    self._loader.delete(file.name)
                else:
                    self._screen.mark(marks.ERASED)
                    registers.step = 3
            case _ if self._message.show(5, 7, passes=message.SHORT):
                registers.end(UiState.EXIT)
