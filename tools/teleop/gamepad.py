"""A gamepad, read through SDL by pygame; it may be plugged in and out at any time.

SDL's game controllers are used, not its joysticks: SDL has the button layouts of hundreds of gamepads, and no user
should have to guess which one is the emergency stop. A device without a layout is named on the screen and not used.
pygame calls that module, `pygame._sdl2.controller`, experimental; hence the narrow pin of the extra `gamepad`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.host.environment import install_extra

from .sticks import Sticks

if TYPE_CHECKING:
    from pygame._sdl2.controller import Controller
    from pygame.event import Event

NONE_CONNECTED = "none connected"
UNPLUGGED = "UNPLUGGED, the robot stopped"

_FULL = 32767
_ENVIRONMENT = {
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
    "SDL_VIDEODRIVER": "dummy",  # pygame reads no events without a display; this one is none
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",  # there is no window that could have the focus
    "SDL_NO_SIGNAL_HANDLERS": "1",  # SIGINT and SIGTERM stop the robot first; SDL would only note them
}


class Button(Enum):
    """The meaning of a button."""

    STOP = auto()
    RELEASE = auto()
    FASTER = auto()
    SLOWER = auto()


@dataclass(frozen=True, slots=True)
class GamepadReading:
    """The state of the gamepad.

    Attributes:
        words: Which gamepad it is, or why there is none.
        sticks: As they are now; None without a gamepad.
        pressed: Buttons that went down since the last reading, in that order.
        lost: Whether the gamepad went away since the last reading.
    """

    words: str
    sticks: Sticks | None = None
    pressed: tuple[Button, ...] = ()
    lost: bool = False


class Gamepad:
    """The first gamepad there is; another one when that is unplugged. To be used in one thread.

    Raises:
        ConfigError: pygame is missing, or cannot do what is needed.
    """

    def __init__(self) -> None:
        os.environ.update(_ENVIRONMENT)
        try:
            import pygame
            from pygame._sdl2 import controller
        except ImportError as error:
            raise ConfigError(
                f"gamepads are read with pygame-ce, which cannot be loaded: {error}.",
                remedy=f"Install it: {install_extra('gamepad')}",
            ) from error
        self._pygame, self._controllers = pygame, controller
        self._meanings = {
            pygame.CONTROLLER_BUTTON_B: Button.STOP,
            pygame.CONTROLLER_BUTTON_A: Button.RELEASE,
            pygame.CONTROLLER_BUTTON_RIGHTSHOULDER: Button.FASTER,
            pygame.CONTROLLER_BUTTON_LEFTSHOULDER: Button.SLOWER,
        }
        self._open: Controller | None = None
        self._instance: int | None = None
        self._words = self._without = NONE_CONNECTED
        pygame.display.init()
        controller.init()

    def read(self) -> GamepadReading:
        """Return what has happened since the last call, without waiting."""
        pressed: list[Button] = []
        lost = changed = False
        for event in self._pygame.event.get():
            if event.type in (self._pygame.JOYDEVICEADDED, self._pygame.JOYDEVICEREMOVED):
                changed = True
            if self._is_ours(event, self._pygame.CONTROLLERDEVICEREMOVED):
                lost, self._without = True, UNPLUGGED
                self._close_joystick()
            elif self._is_ours(event, self._pygame.CONTROLLERBUTTONDOWN) and event.button in self._meanings:
                pressed.append(self._meanings[event.button])
        if changed and self._open is None:
            self._words = self._find() or self._without
        return GamepadReading(self._words, self._sticks(), tuple(pressed), lost)

    def close(self) -> None:
        """Close the gamepad."""
        self._close_joystick()
        self._controllers.quit()
        self._pygame.joystick.quit()
        self._pygame.display.quit()

    def _is_ours(self, event: Event, kind: int) -> bool:
        return bool(event.type == kind and event.instance_id == self._instance)

    def _close_joystick(self) -> None:
        if self._open is not None:
            self._open.quit()
        self._open = self._instance = None

    def _find(self) -> str:
        """Open the first gamepad with a known layout; return its name, or an empty string if there is none."""
        words = ""
        for index in range(self._pygame.joystick.get_count()):
            try:
                if self._controllers.is_controller(index):
                    found = self._controllers.Controller(index)
                    self._open, self._instance = found, found.as_joystick().get_instance_id()
                    return str(found.name)
                words = f"{self._pygame.joystick.Joystick(index).get_name()}: unknown layout"
            except self._pygame.error as error:
                words = f"cannot be opened: {error}"
        return words

    def _sticks(self) -> Sticks | None:
        if self._open is None:
            return None
        names, axis, button = self._pygame, self._open.get_axis, self._open.get_button
        return Sticks(
            left_x=axis(names.CONTROLLER_AXIS_LEFTX) / _FULL,
            left_y=axis(names.CONTROLLER_AXIS_LEFTY) / _FULL,
            right_x=axis(names.CONTROLLER_AXIS_RIGHTX) / _FULL,
            cross_x=button(names.CONTROLLER_BUTTON_DPAD_RIGHT) - button(names.CONTROLLER_BUTTON_DPAD_LEFT),
            cross_y=button(names.CONTROLLER_BUTTON_DPAD_DOWN) - button(names.CONTROLLER_BUTTON_DPAD_UP),
        )
