"""Handlers of the commands for programs, mailboxes and the data log. Source: docs/firmware.md sections 3 and 4."""

from __future__ import annotations

from firmware_protocol import direct, enhanced
from firmware_protocol.enums import InterpreterState
from firmware_protocol.status import Status
from sim_backend.firmware.comm.handler_result import (
    DONE,
    OUT_OF_RANGE,
    HandlerResult,
    handles,
    refuse_with_zeros,
    reply_with,
)
from sim_backend.firmware.command import CommandModule
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.mailboxes import LOG, MAILBOXES
from sim_backend.firmware.ui.ui_module import UiModule
from sim_backend.firmware.vm.memory import OutOfMemory

_NO_PROGRAM = HandlerResult(Status.NO_ACTIVE_PROGRAM)


class ProgramHandlers:
    """The commands for programs; checks come in the firmware's order."""

    def __init__(self, command: CommandModule, loader: Loader, ui: UiModule) -> None:
        self._command, self._loader, self._ui = command, loader, ui

    @handles(direct.StartProgram)
    def start_program(self, command: direct.StartProgram) -> HandlerResult:
        """Request the start of a file from the user interface; only its existence is checked."""
        if not self._loader.look_up(command.name):
            return OUT_OF_RANGE
        self._ui.execute(command.name)
        return DONE

    @handles(direct.StopProgram)
    def stop_program(self, _: direct.StopProgram) -> HandlerResult:
        """Stop the program."""
        if not self._command.active:
            return _NO_PROGRAM
        self._command.stop()
        return DONE

    @handles(direct.GetCurrentProgramName)
    def current_program(self, _: direct.GetCurrentProgramName) -> HandlerResult:
        """Return the name the program was started by, including wildcards."""
        if not self._command.active:
            return refuse_with_zeros(direct.GetCurrentProgramName, Status.NO_ACTIVE_PROGRAM)
        return reply_with(direct.CurrentProgram(self._command.program_name))

    @handles(direct.MessageWrite)
    def message_write(self, command: direct.MessageWrite) -> HandlerResult:
        """Mailboxes exist only while a program runs; size, ending and box are checked before that."""
        size = command.size
        if not 0 < size <= direct.MESSAGE_LIMIT or command.data[size - 1]:
            return OUT_OF_RANGE
        if command.box >= MAILBOXES:
            return HandlerResult(Status.ILLEGAL_MAILBOX)
        if not self._command.active:
            return _NO_PROGRAM
        mailboxes = self._command.mailboxes
        if mailboxes is None:
            return DONE  # a file that is not a program counts as active for one pass
        try:
            mailboxes.write(command.box, command.data[:size])
        except OutOfMemory:
            return HandlerResult(Status.OUT_OF_MEMORY)
        return DONE

    @handles(direct.MessageRead)
    def message_read(self, command: direct.MessageRead) -> HandlerResult:
        """Fetch the oldest message of a box; without a program the box is not checked."""
        box = command.remote_box if command.remote_box < MAILBOXES else None
        status, message = self._oldest(box, remove=command.remove)
        data = message[: direct.MESSAGE_LIMIT].ljust(direct.MESSAGE_LIMIT, b"\0")
        return reply_with(direct.MailboxMessage(command.local_box, len(message) & 0xFF, data), status)

    @handles(direct.DatalogRead)
    def datalog_read(self, command: direct.DatalogRead) -> HandlerResult:
        """Fetch the oldest record that the program wrote."""
        status, record = self._oldest(LOG, remove=command.remove)
        return reply_with(direct.DatalogRecord(len(record) & 0xFF, record[: direct.RECORD_LIMIT]), status)

    def _oldest(self, queue: int | None, *, remove: bool) -> tuple[Status, bytes]:
        """Fetch the oldest message of a queue, None for no such box; damaged memory can make it longer than a reply."""
        if not self._command.active:
            return Status.NO_ACTIVE_PROGRAM, b""
        if queue is None:
            return Status.ILLEGAL_MAILBOX, b""
        mailboxes = self._command.mailboxes
        if mailboxes is None:
            return Status.MAILBOX_EMPTY, b""
        try:
            message = mailboxes.read(queue, remove=remove)
        except OutOfMemory:
            return Status.OUT_OF_MEMORY, b""
        return (Status.MAILBOX_EMPTY, b"") if message is None else (Status.OK, message)

    @handles(enhanced.SetInterpreterState)
    def set_interpreter_state(self, command: enhanced.SetInterpreterState) -> HandlerResult:
        """Pause, step or continue the program."""
        self._command.set_state(int(command.state))
        return self._interpreter()

    @handles(enhanced.GetInterpreterState)
    def interpreter_state(self, _: enhanced.GetInterpreterState) -> HandlerResult:
        """Return the interpreter's state, and the place of the next clump."""
        return self._interpreter()

    def _interpreter(self) -> HandlerResult:
        return reply_with(enhanced.Interpreter(InterpreterState(self._command.state), *self._command.place))

    @handles(enhanced.SetBreakpoints)
    def set_breakpoints(self, command: enhanced.SetBreakpoints) -> HandlerResult:
        """Store breakpoints, in the order of the telegram."""
        records = self._command.records_with(command.clump)
        if records:
            for point in command.points:
                records.set_breakpoint(command.clump, *point)
            self._command.enable_pause()
        return self._breakpoints(command.clump)

    @handles(enhanced.GetBreakpoints)
    def get_breakpoints(self, command: enhanced.GetBreakpoints) -> HandlerResult:
        """Return the breakpoints of a clump."""
        return self._breakpoints(command.clump)

    def _breakpoints(self, clump: int) -> HandlerResult:
        records = self._command.records_with(clump)
        return reply_with(enhanced.Breakpoints(*records.breakpoints(clump))) if records else OUT_OF_RANGE

    @handles(direct.DatalogSetTimes)
    def datalog_set_times(self, command: direct.DatalogSetTimes) -> HandlerResult:
        """Set the data log's clock."""
        self._command.set_times(command.sync_time)
        return DONE
