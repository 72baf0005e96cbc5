"""Commands that only the community's firmware 1.32 has. Source: docs/firmware.md section 11.1.

No ``from __future__ import annotations`` here: the declarations' annotations are read as objects.
"""

from firmware_protocol.telegram import Command, Reply, direct, reply, system
from firmware_protocol.wire import U8, U16, FileName, InterpreterStateField


@reply
class Interpreter(Reply):
    """State of the interpreter, and where the clump is that is next."""

    state: InterpreterStateField
    clump: U8  # 255 while every clump sleeps, or without a program
    offset: U16  # words from the clump's beginning


@direct(0x22, since="1.32")
class SetInterpreterState(Command[Interpreter]):
    """Pause, step or continue the program; ignored without one and in the states 0 and from 4 on.

    In state 0, 5 or above the program neither runs nor ends until the brick is switched off. It cannot be stopped
    while it is paused.
    """

    state: InterpreterStateField


@direct(0x23, since="1.32")
class GetInterpreterState(Command[Interpreter]):
    """Ask what the interpreter does."""


@reply
class Breakpoints(Reply):
    """A clump's four breakpoints; the first one is always empty."""

    enabled_0: U8
    offset_0: U16
    enabled_1: U8
    offset_1: U16
    enabled_2: U8
    offset_2: U16
    enabled_3: U8
    offset_3: U16


@direct(0x24, since="1.32")
class SetBreakpoint(Command[Breakpoints]):
    """Store a breakpoint of a clump; numbers other than 1 to 3 are ignored. None was seen to stop a program."""

    clump: U8
    number: U8
    enabled: U8
    offset: U16


@direct(0x25, since="1.32")
class GetBreakpoints(Command[Breakpoints]):
    """Ask for the breakpoints of a clump."""

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
