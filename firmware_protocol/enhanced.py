"""Commands that only the community's firmware 1.32 has. Source: docs/firmware.md section 11.1.

No ``from __future__ import annotations`` here: the declarations' annotations are read as objects.
"""

from firmware_protocol.telegram import Command, Reply, direct, reply, system
from firmware_protocol.wire import U8, U16, FileName, InterpreterStateField


@reply
class Interpreter(Reply):
    """State of the interpreter, and the place of the next clump."""

    state: InterpreterStateField
    clump: U8  # 255 while every clump sleeps, or without a program
    offset: U16  # words from the clump's beginning


@direct(0x22, since="1.32")
class SetInterpreterState(Command[Interpreter]):
    """Pause, step or continue the program; ignored without a program and in state 0 and the states from 4 on.

    In state 0, 5 or above the program neither runs nor ends: in 0 until the Command map starts another, in the others
    until the brick is switched off. It cannot be stopped while it is paused.
    """

    state: InterpreterStateField


@direct(0x23, since="1.32")
class GetInterpreterState(Command[Interpreter]):
    """Read the interpreter's state."""


@reply
class Breakpoints(Reply):
    """A clump's four breakpoints."""

    enabled_0: U8
    offset_0: U16
    enabled_1: U8
    offset_1: U16
    enabled_2: U8
    offset_2: U16
    enabled_3: U8
    offset_3: U16


@direct(0x24, since="1.32")
class SetBreakpoints(Command[Breakpoints]):
    """Store four breakpoints of a clump, each with its number, 0 to 3. None was seen to stop a program."""

    clump: U8
    first: U8
    first_enabled: U8
    first_offset: U16
    second: U8
    second_enabled: U8
    second_offset: U16
    third: U8
    third_enabled: U8
    third_offset: U16
    fourth: U8
    fourth_enabled: U8
    fourth_offset: U16

    @property
    def points(self) -> tuple[tuple[int, int, int], ...]:
        """Number, enabled and offset of each."""
        return (
            (self.first, self.first_enabled, self.first_offset),
            (self.second, self.second_enabled, self.second_offset),
            (self.third, self.third_enabled, self.third_offset),
            (self.fourth, self.fourth_enabled, self.fourth_offset),
        )


@direct(0x25, since="1.32")
class GetBreakpoints(Command[Breakpoints]):
    """Read the breakpoints of a clump."""

    clump: U8


@reply
class FileRenamed(Reply):
    """The handle that the search used, and the names as sent."""

    handle: U8
    old_name: FileName
    renamed_to: FileName


@system(0xA3, since="1.32")
class RenameFile(Command[FileRenamed]):
    """Rename a file that is not open, if none has the new name."""

    name: FileName
    new_name: FileName
