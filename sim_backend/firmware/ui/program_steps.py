"""A program of five steps made on the brick: its steps, its file and its run. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from firmware_protocol.iomap import ProgramStatus
from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import pack_name
from sim_backend.firmware.sound import SoundModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.screen_marks import Marks
from sim_backend.firmware.ui.states import Place, Programs

_ACTIONS = (0x3, 0x2, 0x9, 0x8, 0xF, 0x7, 0xB, 0xC, 0x4, 0xA, 0x5, 0x6, 0x1, 0xD, 0xE)
_EVENTS = (0x11, 0x16, 0x17, 0x18, 0x13, 0x14, 0x12, 0x19, 0x15)
_ENDS = (0x20, 0x1F)
_CHOICES = (_ACTIONS, _EVENTS, _ACTIONS, _EVENTS, _ENDS)
"""Icons of the items of each step."""

PROGRAM = 1
"""Item of the main menu."""

_FIRST = 2
"""Level of the first step, below the page that shows where to plug in motors and sensors."""

_EMPTY = 0x01

RUN, LEAVE, SAVE = _ENDING = range(3)
"""Items of the page after the last step."""

_READER = "RPGReader.sys"
"""The file that runs it."""
_FILE, _SAVED = "Program.tmp", ".rpg"
"""Name of the file of the program, and the end of its name when it is saved."""
_HEADER = bytes((8, 0, 0, len(_CHOICES), len(_CHOICES), 0, 0, 0))
_CODES = {icon: icon + 0x20 for icon in _ACTIONS} | {icon: icon + 0x30 for icon in _EVENTS} | {0x20: 0xFB, 0x1F: 0xFC}
"""The file of the program: what precedes the steps, and the byte of each step by its icon."""
_ICONS = {code: icon for icon, code in _CODES.items()}
_CHECKED = 2
"""Bytes of the header that a program to run must have."""


class ProgramSteps:
    """The steps that were chosen.

    Args:
        loader: Stores the program.
        programs: Runs it, if there is a file that can.
        sound: Delays its start.

    Attributes:
        icons: The icon of each step, as the display's map has them.
    """

    def __init__(self, loader: Loader, programs: Programs, sound: SoundModule) -> None:
        self._loader, self._programs, self._sound = loader, programs, sound
        self.icons = self._chosen = bytes(len(_CHOICES))
        self._step, self._last = 0, b""

    @property
    def goes_on(self) -> bool:
        """Whether it is the turn of another step than the first one."""
        return self._step > 0

    def is_step(self, menu: Place) -> bool:
        """Return whether a menu, given as the items that lead to it, is one of the steps."""
        return menu[:1] == (PROGRAM,) and _FIRST <= len(menu) < _FIRST + len(_CHOICES)

    def is_run(self, menu: Place) -> bool:
        """Return whether a menu is the page after the last step."""
        return menu[:1] == (PROGRAM,) and len(menu) == _FIRST + len(_CHOICES)

    def items(self, menu: Place) -> int:
        """Return the number of items of a step or of the page after the last one, 0 of another menu."""
        if self.is_run(menu):
            return len(_ENDING)
        return len(_CHOICES[len(menu) - _FIRST]) if self.is_step(menu) else 0

    def drawn(self, menu: Place) -> tuple[Marks, ...]:
        """Return the drawing, pass by pass, of a menu that is opened: a step, or the page after the last one."""
        return marks.FIRST_STEP if len(menu) == _FIRST else self._drawn(1), marks.PAGE

    @property
    def drawn_file(self) -> Sequence[Marks]:
        """The drawing, pass by pass, of a file of five steps; after the last step it begins like the page there."""
        first, *others = marks.NOT_RUN[:-1]
        return marks.FIRST_STEP if self._step < len(_CHOICES) else first, *others

    @property
    def drawn_back(self) -> Marks:
        """The drawing of the step before."""
        return self._drawn(-1)

    def _drawn(self, by: int) -> Marks:
        return marks.STEP if self._moved(by) < len(_CHOICES) else marks.LAST_STEP

    def _moved(self, by: int) -> int:
        """Return the step whose turn is next (1) or was before (-1); the same if more were chosen than there are."""
        return self._step + by * (self._step <= len(_CHOICES))

    def enter(self, place: Place) -> None:
        """Choose an item of a step, or begin with the first one; the choice of the last one stores the program."""
        if len(place) == _FIRST:
            self._chosen, self._step = bytes([_EMPTY] * len(_CHOICES)), 0
        elif self.is_step(place[:-1]):
            self._choose(_CHOICES[len(place) - 1 - _FIRST][place[-1]])
            self._step = self._moved(1)
            if self._step == len(_CHOICES):
                self._store(_HEADER + bytes(_CODES[icon] for icon in self._chosen))
        self.icons = self._chosen

    @property
    def holds(self) -> Mapping[int, Callable[[], bool]]:
        """What holds a pass of the drawing when it runs, by the number of the pass."""
        start = marks.STARTED_WITH
        return {start - 1: self.waits, start: self.waits_for_status, start + 1: self.runs}

    @property
    def actions(self) -> Mapping[int, Callable[[], None]]:
        """What is done at the end of a pass of the drawing when it runs, by the number of the pass."""
        return {marks.STARTED_WITH: self.start, marks.STARTED_WITH + 1: self.end}

    def waits(self) -> bool:
        """Return whether its start waits for the end of a sound."""
        return bool(self._sound.state)

    def waits_for_status(self) -> bool:
        """Return whether its start waits for ProgStatus to be 0."""
        return self._programs.status != ProgramStatus.IDLE

    def runs(self) -> bool:
        """Return whether a file that runs it was there, and it has not ended."""
        return self._programs.status == ProgramStatus.RUNNING

    def start(self) -> None:
        """Have all steps chosen, and start the program in the next pass, for which a file is missing."""
        self._step = len(_CHOICES)
        self._programs.start(pack_name(_READER))

    def end(self) -> None:
        """Forget the program, and reset inputs and outputs."""
        self._programs.reset()

    def save(self, name: str) -> bool:
        """Rename the program; return whether no file had that name."""
        return self._loader.rename(_FILE, name + _SAVED)[0] != Status.FILE_EXISTS

    def _store(self, content: bytes) -> None:
        """Store the program in place of the one before."""
        self._last = content
        self._loader.replace(_FILE, content)

    def open(self, name: str) -> bytes:
        """Copy a program to run, as if this page had made it, and return its icons; none if it is no such program.

        A file that cannot be opened leaves the last program, and an unknown step the icon that was there.
        """
        loader, content = self._loader, self._last
        status, handle, _ = loader.open_read(name)
        if not status:
            _, content = loader.read(handle, len(_HEADER) + len(_CHOICES))
            loader.close(handle)
        if content[:_CHECKED] != _HEADER[:_CHECKED] or len(content) < len(_HEADER) + len(_CHOICES):
            return b""
        self._store(content)
        steps = zip(content[len(_HEADER) :], self.icons, strict=False)
        return bytes(_ICONS.get(code, icon) for code, icon in steps)

    def leave(self, place: Place) -> None:
        """Go back from a step, or from the page after the last one, and forget the choice there.

        The choice of the first one stays.
        """
        if self.is_step(place[:-1]) and self.goes_on:
            self._choose(_EMPTY)
        self._step = self._moved(-1)
        self.icons = self._chosen

    def _choose(self, icon: int) -> None:
        """Choose an icon for the step whose turn it is, which exit from the second item of the last page moves on."""
        if self._step < len(_CHOICES):
            self._chosen = self._chosen[: self._step] + bytes([icon]) + self._chosen[self._step + 1 :]
