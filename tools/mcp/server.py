"""The Model Context Protocol's server: the tools of `Assistant`, with their descriptions."""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Future, wait
from functools import partial, wraps
from typing import Annotated, Any, ParamSpec, TypeVar

import anyio
from anyio.to_thread import run_sync
from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import ToolAnnotations
from pydantic import Field, Strict

import nxtdrive
from nxtdrive.brick import LOW_BATTERY_MV

from ..web.motions import ShortMotion
from ..web.robot import Robot
from .assistant import MAX_DEG, Assistant
from .strict_server import StrictServer

P = ParamSpec("P")
T = TypeVar("T")
Number = Annotated[float, Strict()]
"""Booleans and texts are refused."""

INSTRUCTIONS = """\
A small robot with {parts}. Lengths are in millimetres, angles in degrees,
positive to the right; the pose is x forward, y right, heading clockwise, from where the robot began. One call
drives at most {max_mm:g} mm or turns at most {max_deg:g} degrees. {safety}
Missions search for targets by name, drive there and recover by themselves; start one with `mission_run` and follow it
with `mission_status`. `stop` works at any time. A person may stop the robot too; then nothing drives until a person
releases it."""
SENSORS = {"sonar": "a sonar that looks ahead", "bumper": "a bumper"}
SAFETY = {"sonar": "before an obstacle in the sonar's beam", "bumper": "when the bumper touches something"}
"""What ends driving forward, by sensor."""

READS = ToolAnnotations(read_only_hint=True, open_world_hint=False)
MOVES = ToolAnnotations(destructive_hint=False, open_world_hint=False)
STOPS = ToolAnnotations(destructive_hint=False, idempotent_hint=True, open_world_hint=False)
LONGEST_WAIT_S = 60.0
CHECK_INTERVAL_S = 0.2
"""How often the main thread checks for signals, which an unlimited wait ignores on Windows."""


def refusing(call: Callable[P, Awaitable[T]]) -> Callable[P, Awaitable[T]]:
    """Return a tool that reports its `ValueError` to the assistant."""

    @wraps(call)
    async def tool(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return await call(*args, **kwargs)
        except ValueError as error:
            raise ToolError(str(error)) from None

    return tool


class Tools:
    """The tools; each method is one, and its docstring is what the assistant reads.

    Args:
        assistant: Does what they say.
    """

    def __init__(self, assistant: Assistant) -> None:
        self._assistant = assistant

    async def look(self) -> Image:
        """Take a picture with the robot's camera."""
        return Image(data=await run_sync(self._assistant.look), format="jpeg")

    async def drive_mm(self, distance_mm: Number) -> dict[str, Any]:
        """Drive straight by a distance, negative: back. Returns why it ended, how far it went, and the sensors."""
        return await self._finish(self._assistant.drive(distance_mm))

    async def turn(self, angle_deg: Number) -> dict[str, Any]:
        """Turn on the spot by an angle in degrees, positive to the right. Returns the angle turned, and the sensors."""
        return await self._finish(self._assistant.turn(angle_deg))

    async def range(self) -> dict[str, Any]:
        """Read sonar (mm ahead, null without an echo), bumper and pose; `lacking` names those it does not have."""
        return await self._finish(self._assistant.read())

    async def battery(self) -> dict[str, Any]:
        """Read the battery's voltage, and whether the battery is low and should be charged soon."""
        battery_mv = (await self._finish(self._assistant.read()))["battery_mv"]
        return {"battery_v": battery_mv / 1000, "low": battery_mv < LOW_BATTERY_MV}

    async def missions(self) -> dict[str, Any]:
        """List the missions that can be started, and the proposed one; the built-in one has the empty name."""
        missions = self._assistant.missions
        return {"missions": ["", *await run_sync(missions.names)], "proposed": missions.proposed}

    async def mission_run(
        self, mission: str = "", profile: str = "", decide: Annotated[bool, Strict()] = False
    ) -> dict[str, Any]:
        """Start a mission; return once it has begun. With `decide`, each recovery waits for your `mission_choose`."""
        assistant = self._assistant
        # files are read in a thread, as `stop` must not wait for them
        start = partial(assistant.start_mission, mission, profile, decide=decide, end_count=assistant.robot.end_count)
        await run_sync(start)
        return assistant.status()

    async def mission_status(self, wait_s: Annotated[Number, Field(ge=0, le=LONGEST_WAIT_S)] = 0.0) -> dict[str, Any]:
        """Describe what mission and robot do; wait up to 60 s for the mission's end or its next question."""
        return await run_sync(self._assistant.status, wait_s, abandon_on_cancel=True)

    async def mission_choose(self, number: Annotated[int, Strict()]) -> dict[str, Any]:
        """Answer the open question of a mission with the number of a candidate."""
        self._assistant.choose(number)
        return {"chosen": number}

    async def stop(self) -> dict[str, Any]:
        """Stop the robot now, and end its motion or mission."""
        # a thread of its own: calls that wait may have taken all the others
        return {"stopped": await run_sync(self._assistant.stop, limiter=anyio.CapacityLimiter(1))}

    async def explain(self, run: str = "") -> dict[str, Any]:
        """Explain the decisions of a run, by default the latest: what failed, what was known, the choice, and why."""
        return await run_sync(self._assistant.explain, run)

    async def _finish(self, motion: ShortMotion) -> dict[str, Any]:
        """Wait for the end of a motion; cancelling the call aborts it."""
        try:
            return await run_sync(self._assistant.wait, motion, abandon_on_cancel=True)
        except anyio.get_cancelled_exc_class():
            motion.end()
            raise


def instructions(assistant: Assistant) -> str:
    """Return what the assistant has to know of the robot."""
    lacking = assistant.robot.lacking
    *parts, last = ["two driven wheels", "a camera", *(SENSORS[each] for each in SENSORS if each not in lacking)]
    ends = " or ".join(SAFETY[each] for each in SAFETY if each not in lacking)
    return INSTRUCTIONS.format(
        parts=f"{', '.join(parts)} and {last}",
        safety=f"Driving forward ends {ends}: read `ended`." if ends else "Nothing stops it before an obstacle.",
        max_mm=assistant.max_mm,
        max_deg=MAX_DEG,
    )


def make_server(assistant: Assistant) -> MCPServer[Any]:
    """Return a server with the tools of an assistant."""
    server = StrictServer(
        "nxtdrive",
        instructions=instructions(assistant),
        version=nxtdrive.__version__,
        log_level="WARNING",
    )
    tools = Tools(assistant)
    stop = ((tools.stop, STOPS),)
    read = ((each, READS) for each in (tools.look, tools.range, tools.battery, tools.missions, tools.mission_status))
    move = ((each, MOVES) for each in (tools.drive_mm, tools.turn, tools.mission_run, tools.mission_choose))
    for tool, kind in (*stop, *read, *move, (tools.explain, READS)):
        server.add_tool(refusing(tool), annotations=kind)
    return server


def serve(server: MCPServer[Any], robot: Robot) -> None:
    """Serve standard input and output until the assistant leaves, a signal comes, or the robot's thread ends.

    The protocol has a thread of its own: it reads standard input in a way that no signal ends.

    Raises:
        KeyboardInterrupt: A signal came.
    """
    served: Future[None] = Future()

    def work() -> None:
        try:
            _run(server)
            served.set_result(None)
        except BaseException as error:  # noqa: BLE001 - it is raised below
            served.set_exception(error)

    threading.Thread(target=work, name="nxtdrive mcp", daemon=True).start()
    while robot.alive and not served.done():
        wait([served], CHECK_INTERVAL_S)
    if served.done():
        served.result()


def _run(server: MCPServer[Any]) -> None:
    """Serve until the assistant leaves, or dies before it was answered."""
    try:
        server.run()
    except* BrokenPipeError:
        pass
