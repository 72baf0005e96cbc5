"""Starting and stopping programs on the brick, and making sure of it.

The firmware says OK to a start whether or not anything starts (docs/firmware.md section 1, facts 1 to 4 and 16); here a
start is prepared, confirmed, and refused where the brick would hang.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.direct import GetCurrentProgramName, StartProgram, StopProgram
from firmware_protocol.errors import BrickBusy, BrickError, LocalProtocolError
from firmware_protocol.iomap import COMMAND, UI, ProgramStatus, UiFlag
from firmware_protocol.status import Status

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

PROGRAMS = (".rxe", ".rtm", ".rpg")
"""What can be started; files of other kinds make the brick hang, and sounds are played. Source: section 1, fact 2."""
BUSY_S = 4.0
"""The brick takes no program for 750 ms after one has ended, and for 3.7 s after it was switched on (fact 1)."""
START_S = 0.5
"""A program runs 8 ms after it was started (fact 1)."""
STOP_S = 0.5
"""A program is gone 2 ms after it was stopped. Source: section 4, 0x01."""
STEP_S = 0.01
"""Between two looks."""


def running_program(brick: Brick) -> str | None:
    """Name of the program that runs, as it was given to the start; None if none runs."""
    try:
        return brick.request(GetCurrentProgramName()).name
    except BrickError as error:
        if error.status is Status.NO_ACTIVE_PROGRAM:
            return None
        raise


def start_program(brick: Brick, name: str) -> None:
    """Start a program and return when it runs, or has run; our motors are stopped before, as it resets all ports.

    Raises:
        LocalProtocolError: This is no program; nothing was sent.
        BrickError: FILE_NOT_FOUND: it is not on the brick.
        BrickBusy: Another program runs, or the brick shows a dialog, or it cannot run this file.
    """
    if not name.lower().endswith(PROGRAMS):
        raise LocalProtocolError(
            f"{name!r} is no program, and the brick would hang.",
            remedy=f"Programs end in {', '.join(PROGRAMS)}; play_sound_file() plays sounds.",
        )
    if not brick.files.exists(name):
        raise BrickError(Status.FILE_NOT_FOUND, "StartProgram")
    if other := running_program(brick):
        raise BrickBusy(f"{other} is running.", remedy="Stop it first.")
    brick.stop_motors()
    _wait_until_free(brick)
    brick.request(StartProgram(name))
    brick.forget_input_modes()
    _confirm_start(brick, name)


def stop_program(brick: Brick) -> bool:
    """Stop the program and return when it is gone.

    A second stop right behind the first would end the next program at its start (fact 3). So nothing is sent when no
    program runs, and this returns only when the brick has none.

    Returns:
        Whether one ran.

    Raises:
        BrickBusy: It does not stop.
    """
    if running_program(brick) is None:
        return False
    try:
        brick.request(StopProgram())
    except BrickError as error:
        if error.status is not Status.NO_ACTIVE_PROGRAM:  # it has just ended by itself
            raise
    deadline = brick.now() + STOP_S + brick.latency_s
    while running_program(brick) is not None:
        if brick.now() >= deadline:
            raise BrickBusy("the program does not stop.", remedy="Press the orange button, then the grey one.")
        brick.sleep(STEP_S)
    return True


def _wait_until_free(brick: Brick) -> None:
    flags = UI.field("Flags")
    deadline = brick.now() + BUSY_S
    while flags.decode(brick.request(flags.read()).data) & UiFlag.BUSY:
        if brick.now() >= deadline:
            raise BrickBusy("the brick is busy with itself.", remedy="Does its display show a dialog? Press a button.")
        brick.sleep(STEP_S)


def _confirm_start(brick: Brick, name: str) -> None:
    """Wait until the program runs; one that is very short has ended by then."""
    result = COMMAND.field("ProgStatus")
    deadline = brick.now() + START_S + brick.latency_s
    while running_program(brick) is None:
        status = result.decode(brick.request(result.read()).data)
        if status == ProgramStatus.ERROR:
            raise BrickBusy(f"the brick cannot run {name}.", remedy="Was it compiled for firmware 1.05 or later?")
        if status in (ProgramStatus.OK, ProgramStatus.ABORTED):
            return
        if brick.now() >= deadline:
            raise BrickBusy(f"{name} did not start.", remedy="Does the display show a dialog? Press a button.")
        brick.sleep(STEP_S)
