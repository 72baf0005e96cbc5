"""What the commands to programs, mailboxes and the data log do while no program runs.

Source: docs/firmware.md section 4.
"""

from __future__ import annotations

from firmware_protocol.direct import (
    MESSAGE_LIMIT,
    DatalogRead,
    DatalogRecord,
    DatalogSetTimes,
    GetCurrentProgramName,
    MessageRead,
    MessageWrite,
    StartProgram,
    StopProgram,
)
from firmware_protocol.status import Status
from sim_backend.firmware.answer import DONE, OUT_OF_RANGE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.command import MAILBOXES, CommandModule
from sim_backend.firmware.loader import Loader

_NO_PROGRAM = Answer(Status.NO_ACTIVE_PROGRAM)


class ProgramHandlers:
    """Refusals, in the order in which the firmware checks."""

    def __init__(self, command: CommandModule, loader: Loader) -> None:
        self._command, self._loader = command, loader

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            StartProgram: self.start_program,
            StopProgram: self.stop_program,
            GetCurrentProgramName: self.current_program,
            MessageWrite: self.message_write,
            MessageRead: self.message_read,
            DatalogRead: self.datalog_read,
            DatalogSetTimes: self.datalog_set_times,
        }

    def start_program(self, command: StartProgram) -> Answer:
        """Refuse: a program that is there cannot be run, for there is no interpreter."""
        return Answer(Status.UNKNOWN_OPCODE) if self._loader.exists(command.name) else OUT_OF_RANGE

    def stop_program(self, _: StopProgram) -> Answer:
        """There is none to stop."""
        return _NO_PROGRAM

    def current_program(self, _: GetCurrentProgramName) -> Answer:
        """An empty name."""
        return refuse_with_zeros(GetCurrentProgramName, Status.NO_ACTIVE_PROGRAM)

    def message_write(self, command: MessageWrite) -> Answer:
        """Mailboxes exist only while a program runs; size, ending and box are checked before that."""
        size = command.size
        if not 0 < size <= MESSAGE_LIMIT or command.data[size - 1]:
            return OUT_OF_RANGE
        if command.box >= MAILBOXES:
            return Answer(Status.ILLEGAL_MAILBOX)
        return _NO_PROGRAM

    def message_read(self, _: MessageRead) -> Answer:
        """No message; the box is not even looked at."""
        return refuse_with_zeros(MessageRead, Status.NO_ACTIVE_PROGRAM)

    def datalog_read(self, _: DatalogRead) -> Answer:
        """No record."""
        return answer(DatalogRecord(0, b""), Status.NO_ACTIVE_PROGRAM)

    def datalog_set_times(self, command: DatalogSetTimes) -> Answer:
        """Set the data log's clock."""
        self._command.set_times(command.sync_time)
        return DONE
