"""The terminal: keys to controls, the pilot's view to the screen."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from functools import partial
from typing import ClassVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.events import Key
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Footer, Header, Static

from firmware_protocol.printable import printable
from nxtdrive.motion.lease import stopping_on_error

from .controls import STEP_PERCENT, Controls, Direction
from .gamepad import Button, Gamepad
from .latest_frame import FPS, LatestFrame
from .pilot import Pilot, PilotState
from .widgets import LEGEND, CameraView, KeysScreen

DIRECTIONS = {
    "up": Direction.FORWARD,
    "w": Direction.FORWARD,
    "down": Direction.BACK,
    "s": Direction.BACK,
    "left": Direction.LEFT,
    "a": Direction.LEFT,
    "right": Direction.RIGHT,
    "d": Direction.RIGHT,
    "q": Direction.FORWARD_LEFT,
    "e": Direction.FORWARD_RIGHT,
}
"""Keys that drive."""
GAMEPAD_EVERY_S = 0.02
"""From one reading of the gamepad to the next; several within a step of the pilot."""


class Teleop(App[None]):
    """Drives while it runs; the robot stands still when it has ended.

    The pilot drives in a thread of its own. The screen shows its latest step and the camera's latest frame when there
    is time for it, so that drawing delays neither driving nor keys.

    Args:
        pilot: Drives.
        controls: The input.
        now: The clock of the controls.
        name: Which brick, for the title.
        gamepad: The gamepad, if one is used; read between the keys.
        latest: The latest frame of the camera, if there is one.
        why_no_camera: In words, for the screen.
        lacking: Which of ``sonar`` and ``bumper`` the robot does not have.
        stopped: Checked between the pilot's steps; once it returns True, the robot stops and the screen closes.

    Attributes:
        failure: The error, or the defect, that ended it, or None.
    """

    TITLE = "nxtdrive teleop"
    CSS = """
    #body { layout: horizontal; height: 1fr; }
    #sight { width: 1fr; height: 1fr; }
    #camera { width: 1fr; height: auto; border: round $primary; }
    #camera.alarm { border: heavy $error; }
    #map { width: 1fr; height: 1fr; border: round $primary; }
    #panel { width: 42; height: 1fr; border: round $primary; padding: 0 1; }
    #panel.alarm { border: heavy $error; }
    .-narrow #body { layout: vertical; }
    .-narrow #panel { dock: top; width: 1fr; height: auto; }
    .-narrow.-low #camera { display: none; }
    .-low Header { display: none; }
    """
    HORIZONTAL_BREAKPOINTS: ClassVar[list[tuple[int, str]]] = [(0, "-narrow"), (72, "-wide")]  # type: ignore[misc] # theirs is a union
    VERTICAL_BREAKPOINTS: ClassVar[list[tuple[int, str]]] = [(0, "-low"), (30, "-high")]  # type: ignore[misc] # as above
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "emergency_stop", "STOP", priority=True),
        Binding("question_mark", "keys", "keys", key_display="?"),
        Binding("escape", "close", "quit", priority=True, key_display="esc"),
        Binding("enter", "release", "release"),
        Binding("plus,equals_sign", f"faster({STEP_PERCENT})", "faster", key_display="+"),
        Binding("minus", f"faster({-STEP_PERCENT})", "slower", key_display="-"),
        Binding("x,X", "set_neutral", "halt", key_display="x"),
        Binding("ctrl+c,ctrl+q", "leave", "quit", priority=True, show=False),
    ]

    class Ended(Message):
        """The pilot has stopped driving."""

    def __init__(
        self,
        pilot: Pilot,
        controls: Controls,
        now: Callable[[], float],
        name: str = "",
        gamepad: Gamepad | None = None,
        latest: LatestFrame | None = None,
        why_no_camera: str = "",
        lacking: Collection[str] = (),
        stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__()
        self.sub_title = printable(name)
        self.failure: Exception | None = None
        self._pilot, self._controls, self._now = pilot, controls, now
        self._gamepad, self._gamepad_words = gamepad, ""
        self._latest, self._why_no_camera = latest, why_no_camera
        self._view: PilotState | None = None
        self._lacking = lacking
        self._stopped = stopped
        self._leaving = threading.Event()
        self._driving = threading.Thread(target=self._drive, name="teleop pilot", daemon=True)

    def compose(self) -> ComposeResult:
        """Lay out the picture, the map, the panel and the list of keys."""
        floor = Static(id="map", markup=False)
        floor.border_subtitle = LEGEND
        yield Header(icon="")  # it would open the palette
        with Container(id="body"):
            with Vertical(id="sight"):
                if self._latest is not None:
                    yield CameraView(self._latest)
                yield floor
            yield Static(id="panel", markup=False)
        yield Footer()

    def on_mount(self) -> None:
        """Start the driving thread."""
        self._driving.start()
        self.set_interval(1 / FPS, partial(self._show, self.screen_stack[0]))
        if self._gamepad is not None:
            self.set_interval(GAMEPAD_EVERY_S, partial(self._listen, self._gamepad))

    def on_key(self, event: Key) -> None:
        """Drive in the direction of the key."""
        direction = DIRECTIONS.get(event.key.lower())  # W with caps lock
        if direction is not None:
            self._controls.press(direction, self._now())

    def on_app_blur(self) -> None:
        """Forget the pressed key when the terminal's window loses the focus."""
        self._controls.release_keys()

    def action_emergency_stop(self) -> None:
        """Stop at once and stay stopped."""
        self._controls.emergency_stop()
        self._close_keys()

    def action_keys(self) -> None:
        """List the keys; driving continues."""
        self.push_screen(KeysScreen())

    def action_close(self) -> None:
        """Close the list of keys, or leave."""
        if not self._close_keys():
            self.action_leave()

    def action_release(self) -> None:
        """End the emergency stop."""
        self._controls.release()

    def action_set_neutral(self) -> None:
        """Stop."""
        self._controls.set_neutral()

    def action_faster(self, step_percent: int) -> None:
        """Change the speed."""
        self._controls.faster(step_percent)

    def action_leave(self) -> None:
        """Stop and quit; the screen closes when the robot stands still."""
        self._leaving.set()

    def _close_keys(self) -> bool:
        """Close the list of keys; return whether it was open."""
        open_ = isinstance(self.screen, KeysScreen)
        if open_:
            self.pop_screen()
        return open_

    def _show(self, screen: Screen[object]) -> None:
        """Show the pilot's latest step and the camera's latest frame."""
        view = self._view
        if view is None or not self.is_running:  # leaving takes the screen apart while the clock still ticks
            return
        floor, panel = screen.query_one("#map", Static), screen.query_one("#panel", Static)
        size = floor.content_size
        floor.update("\n".join(self._pilot.map.draw(view.pose, size.width, size.height)))
        panel.set_class(self._controls.stopped, "alarm")
        compact = screen.has_class("-narrow")
        panel.update(describe(view, self._gamepad_words, self._why_no_camera, self._lacking, compact=compact))
        for camera in screen.query(CameraView):
            if camera.display:
                camera.show(self._now())

    def on_teleop_ended(self) -> None:
        """Leave."""
        self.exit()

    def finish(self) -> None:
        """Stop the driving thread and wait for it; called when the screen is closed, for any reason."""
        self._leaving.set()
        if self._driving.is_alive():
            self._driving.join()

    def _listen(self, gamepad: Gamepad) -> None:
        """Apply the gamepad's input."""
        reading = gamepad.read()
        self._gamepad_words = reading.words
        for button in reading.pressed:
            self._act_on(button)
        if reading.lost:
            self._controls.set_neutral()
        if reading.sticks is not None:
            self._controls.steer(reading.sticks.ahead, reading.sticks.turn, self._now())

    def _act_on(self, button: Button) -> None:
        match button:
            case Button.STOP:
                self._controls.emergency_stop()
            case Button.RELEASE:
                self._controls.release()
            case Button.FASTER:
                self._controls.faster(STEP_PERCENT)
            case Button.SLOWER:
                self._controls.faster(-STEP_PERCENT)

    def _drive(self) -> None:
        """Run the pilot; only this thread uses the brick."""
        try:
            with stopping_on_error(self._pilot.stop):
                while not (self._leaving.is_set() or self._stopped()):
                    self._view = self._pilot.step()
            self._pilot.stop()
        except Exception as error:  # noqa: BLE001 - it ends the program, which raises it
            self.failure = error
        finally:
            self.post_message(self.Ended())


def describe(
    view: PilotState, gamepad: str = "", camera: str = "", lacking: Collection[str] = (), *, compact: bool = False
) -> str:
    """Format the panel's text.

    Args:
        view: The pilot's latest step.
        gamepad: Name of the gamepad, or why there is none.
        camera: Why there is no camera.
        lacking: Which of ``sonar`` and ``bumper`` the robot does not have.
        compact: Only what driving needs, in few lines.
    """
    ahead = "no echo" if view.range_mm is None else f"{view.range_mm:.0f} mm"
    if "sonar" in lacking:
        ahead = "no sonar"
    speed = f"{view.speed_mm_s:+z.0f} mm/s  ({view.percent} %)"
    power, link = f"{view.battery_mv / 1000:.2f} V", f"{view.latency_ms:.0f} ms"
    seen = view.target_text or camera
    if compact:
        bumper = "  BUMPER PRESSED" if view.touching else ""
        rows = {"speed": speed, "ahead": ahead + bumper, "power": f"{power}, link {link}", "camera": seen}
    else:
        rows = {
            "speed": speed,
            "turn": f"{view.turn_deg_s:+z.0f} °/s, right is +",
            "ahead": ahead,
            "bumper": "none" if "bumper" in lacking else "PRESSED" if view.touching else "free",
            "at": f"{view.pose.x_mm:z.0f} mm ahead, {view.pose.y_mm:z.0f} mm right",
            "heading": f"{view.pose.heading_deg:z.0f}°",
            "battery": power,
            "link": link,
            "camera": seen or "no target (--target NAME)",
            "gamepad": gamepad or "off (--gamepad)",
        }
    keys = "" if compact else "\n\narrows, WASD: drive   ?: all keys\nhold to drive, let go to stop"
    state = view.state if compact else f"state    {view.state}"
    return "\n".join(map(printable, [state, *(f"{label:<8} {text}" for label, text in rows.items() if text)])) + keys
