"""What the commands to programs, mailboxes and the data log do. Source: docs/firmware.md sections 3 and 4."""

from __future__ import annotations

from firmware_protocol.direct import (
    MESSAGE_LIMIT,
    CurrentProgram,
    DatalogRead,
    DatalogRecord,
    DatalogSetTimes,
    GetCurrentProgramName,
    MailboxMessage,
    MessageRead,
    MessageWrite,
    StartProgram,
    StopProgram,
)
from firmware_protocol.status import Status
from sim_backend.firmware.answer import DONE, OUT_OF_RANGE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.command import CommandModule
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.mailboxes import MAILBOXES
from sim_backend.firmware.ui import UiModule
from sim_backend.firmware.vm.memory import OutOfMemory

_NO_PROGRAM = Answer(Status.NO_ACTIVE_PROGRAM)


class ProgramHandlers:
    """Checks in the firmware's order, then what is asked for."""

    def __init__(self, command: CommandModule, loader: Loader, ui: UiModule) -> None:
        self._command, self._loader, self._ui = command, loader, ui

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
        """Ask the user interface to start a file; only its existence is checked."""
        if not self._loader.exists(command.name):
            return OUT_OF_RANGE
        self._ui.execute(command.name)
        return DONE

    def stop_program(self, _: StopProgram) -> Answer:
        """Stop the program."""
        if not self._command.active:
            return _NO_PROGRAM
        self._command.stop()
        return DONE

    def current_program(self, _: GetCurrentProgramName) -> Answer:
        """The name by which it was started, wildcards and all."""
        if not self._command.active:
            return refuse_with_zeros(GetCurrentProgramName, Status.NO_ACTIVE_PROGRAM)
        return answer(CurrentProgram(self._command.file_name.split(b"\0")[0].decode("latin-1")))

    def message_write(self, command: MessageWrite) -> Answer:
        """Mailboxes exist only while a program runs; size, ending and box are checked before that."""
        size = command.size
        if not 0 < size <= MESSAGE_LIMIT or command.data[size - 1]:
            return OUT_OF_RANGE
        if command.box >= MAILBOXES:
            return Answer(Status.ILLEGAL_MAILBOX)
        mailboxes = self._command.mailboxes
        if mailboxes is None:
            return _NO_PROGRAM
        try:
            mailboxes.write(command.box, command.data[:size])
        except OutOfMemory:
            return Answer(Status.OUT_OF_MEMORY)
        return DONE

    def message_read(self, command: MessageRead) -> Answer:
        """Fetch the oldest message of a box; without a program the box is not even looked at."""
        mailboxes = self._command.mailboxes
        if mailboxes is None:
            return refuse_with_zeros(MessageRead, Status.NO_ACTIVE_PROGRAM)
        if command.remote_box >= MAILBOXES:
            return refuse_with_zeros(MessageRead, Status.ILLEGAL_MAILBOX)
        try:
            message = mailboxes.read(command.remote_box, remove=command.remove)
        except OutOfMemory:
            return refuse_with_zeros(MessageRead, Status.OUT_OF_MEMORY)
        status = Status.MAILBOX_EMPTY if message is None else Status.OK
        message = message or b""
        data = message[:MESSAGE_LIMIT].ljust(MESSAGE_LIMIT, b"\0")
        return answer(MailboxMessage(command.local_box, len(message) & 0xFF, data), status)

    def datalog_read(self, _: DatalogRead) -> Answer:
        """No record: none of the instructions that are simulated writes one."""
        status = Status.MAILBOX_EMPTY if self._command.active else Status.NO_ACTIVE_PROGRAM
        return answer(DatalogRecord(0, b""), status)

    def datalog_set_times(self, command: DatalogSetTimes) -> Answer:
        """Set the data log's clock."""
        self._command.set_times(command.sync_time)
        return DONE
