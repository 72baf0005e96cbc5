"""Starting and stopping programs on the brick, with confirmation.

The firmware replies OK to a start even if nothing starts (docs/firmware.md section 1, facts 1 to 4 and 16). So a start
is prepared and confirmed, and refused if the brick would hang.
"""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.direct import GetCurrentProgramName, MessageRead, MessageWrite, StartProgram, StopProgram
from firmware_protocol.errors import BrickBusy, BrickError, LocalProtocolError
from firmware_protocol.iomap import COMMAND, UI, ProgramStatus, UiFlag
from firmware_protocol.status import Status
from nxtdrive.link.link import Link
from nxtdrive.onboard.files import Files
from nxtdrive.ports import in_range, of_type

MAILBOXES = 10
"""Mailboxes in each direction; outgoing ones follow the incoming ones. Source: docs/firmware.md section 4, 0x13."""
PROGRAMS = (".rxe", ".rtm", ".rpg")
"""Extensions of programs; starting other files makes the brick hang. Source: docs/firmware.md section 1, fact 2."""
BUSY_S = 4.0
"""The brick starts no program for 750 ms after one has ended, and for 3.7 s after it was switched on (fact 1)."""
START_S = 0.5
"""Timeout for a start, which takes 8 ms (fact 1)."""
STOP_S = 0.5
"""Timeout for a stop, which takes 2 ms. Source: docs/firmware.md section 4, 0x01."""
STEP_S = 0.01
"""Interval for polling."""


class Programs:
    """The programs on a brick, and messages to and from the one that runs.

    Args:
        link: The link to the brick.
        files: The files on the brick.
        stop_motors: Called before a program starts, as that resets all ports.
    """

    def __init__(self, link: Link, files: Files, stop_motors: Callable[[], None]) -> None:
        self._link = link
        self._files = files
        self._stop_motors = stop_motors

    @property
    def running(self) -> str | None:
        """Name of the running program, as it was given to the start; None if none runs."""
        try:
            return self._link.request(GetCurrentProgramName()).name
        except BrickError as error:
            if error.status is Status.NO_ACTIVE_PROGRAM:
                return None
            raise

    def start(self, name: str) -> None:
        """Stop the motors and start a program, which resets all ports; returns when it runs, or has run.

        Raises:
            LocalProtocolError: The file is not a program; nothing was sent.
            BrickError: FILE_NOT_FOUND: The program is not on the brick.
            BrickBusy: Another program runs, or the brick shows a dialog or cannot run this file.
        """
        if not of_type("name", name, str).lower().endswith(PROGRAMS):
            raise LocalProtocolError(
                f"{name!r} is not a program, and the brick would hang.",
                remedy=f"Programs end in {', '.join(PROGRAMS)}; sounds are played, not started.",
            )
        if not self._files.exists(name):
            raise BrickError(Status.FILE_NOT_FOUND, "StartProgram")
        if other := self.running:
            raise BrickBusy(f"{other} is running.", remedy="Stop it first.")
        self._stop_motors()
        self._wait_until_free()
        with self._files.exclusive():
            self._link.request(StartProgram(name))
        self._confirm_start(name)

    def stop(self) -> bool:
        """Stop the running program; returns when it has ended.

        A second stop directly after the first would end the next program at its start (fact 3). So nothing is sent if
        no program runs.

        Returns:
            Whether a program ran.

        Raises:
            BrickBusy: The program does not stop.
        """
        if self.running is None:
            return False
        link = self._link
        try:
            link.request(StopProgram())
        except BrickError as error:
            if error.status is not Status.NO_ACTIVE_PROGRAM:  # it has just ended on its own
                raise
        deadline = link.now() + STOP_S + link.latency_s
        while self.running is not None:
            if link.now() >= deadline:
                raise BrickBusy("the program does not stop.", remedy="Press the orange button, then the grey one.")
            link.sleep(STEP_S)
        return True

    def write_message(self, box: int, message: str) -> None:
        """Put a message of at most 58 characters into mailbox 1..10 of the running program."""
        in_range("box", box, 1, MAILBOXES)
        self._link.request(MessageWrite.text(box - 1, message))

    def read_message(self, box: int, *, remove: bool = True) -> str:
        """Take the next message of the running program from mailbox 1..10.

        A program in NXC sends it by ``SendResponseString(MAILBOX1, ...)``; ``SendMessage`` fills its own mailboxes.

        Raises:
            MailboxEmpty: There is no message.
        """
        in_range("box", box, 1, MAILBOXES)
        return self._link.request(MessageRead(MAILBOXES + box - 1, box - 1, remove)).text

    def _wait_until_free(self) -> None:
        link, flags = self._link, UI.field("Flags")
        deadline = link.now() + BUSY_S
        while flags.decode(link.request(flags.read()).data) & UiFlag.BUSY:
            if link.now() >= deadline:
                raise BrickBusy(
                    "the brick's user interface is busy.", remedy="Does its display show a dialog? Press a button."
                )
            link.sleep(STEP_S)

    def _confirm_start(self, name: str) -> None:
        """Wait until the program runs, or has ended if it is very short."""
        link, result = self._link, COMMAND.field("ProgStatus")
        deadline = link.now() + START_S + link.latency_s
        while self.running is None:
            status = result.decode(link.request(result.read()).data)
            if status == ProgramStatus.ERROR:
                raise BrickBusy(f"the brick cannot run {name}.", remedy="Was it compiled for firmware 1.05 or later?")
            if status in (ProgramStatus.OK, ProgramStatus.ABORTED):
                return
            if link.now() >= deadline:
                raise BrickBusy(f"{name} did not start.", remedy="Does the display show a dialog? Press a button.")
            link.sleep(STEP_S)
