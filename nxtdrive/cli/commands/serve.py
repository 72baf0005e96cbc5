"""``nxtdrive serve``: the thesis's line protocol on a TCP port."""

from __future__ import annotations

import argparse
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_robot_argument, mission_brick
from nxtdrive.cli.output import make_console, print_line, write_error
from nxtdrive.cli.pace import in_real_time
from nxtdrive.cli.page_options import add_port_argument
from nxtdrive.signals import until_signal

if TYPE_CHECKING:
    from behaviors.journal import Record
    from behaviors.mission import Mission
DESCRIPTION = """\
Serve the robot to your own agent, such as one in AgentSpeak: each line is a
request ("arrive lena"), each reply a small integer.

connect       0 not connected, 1 connected
arrive NAME   searches, then drives: 0 call it again, 1 arrived, 2 failed
select        was the target recognised in this search: 0 no, 1 yes
move_to DEG   turns right and advances once, ten times in all: 0 moving, 1 done
bye           ends the session, motors off
stop          stops at once; target NAME, status and why are further verbs
choose N      takes candidate N of those that `evidence` returns, and lets the
              profile drive until the next failure: 0 a decision is open,
              1 all targets are reached, 2 the mission has ended otherwise

One client at a time; when it leaves, the motors stop. A simulated brick runs in
real time here; with sim://?pace=fast time passes only while a command runs."""
EXAMPLES = """\
  nxtdrive serve
  nxtdrive serve --nxt "sim://figure6?seed=1" --port 0
  nxtdrive serve my-mission.toml --nxt usb:// --camera 0"""

PORT = 7001


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "mission",
        metavar="MISSION.toml",
        nargs="?",
        type=Path,
        help="the targets, the robot and its parameters (default: the built-in mission)",
    )
    add_brick_arguments(parser)
    add_robot_argument(parser)
    parser.add_argument("--camera", metavar="SOURCE", help="as for `nxtdrive run`")
    add_port_argument(parser, "TCP port", PORT)
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="address to listen on (default: 127.0.0.1, this computer only)",
    )


def run(args: argparse.Namespace) -> int:
    """Serve until a signal arrives; return the exit code."""
    from nxtdrive.mission.assembly import open_robot
    from nxtdrive.mission.files import read_mission_file
    from nxtdrive.mission.line_server import LineServer, sessions
    from nxtdrive.recording.status_line import StatusLine
    from nxtdrive.transports.address import Address

    mission = read_mission_file(args.mission, args.robot)
    with ExitStack() as stack:
        stopped = stack.enter_context(until_signal())
        robot = stack.enter_context(open_robot(in_real_time(mission_brick(args)), args.camera, reconnect=False))
        brick = robot.brick
        vision = robot.vision(mission)
        real_time = Address.parse(brick.link.transport.address).options.get("pace") == "realtime"
        status = stack.enter_context(StatusLine(make_console(stderr=True)))
        server = LineServer(
            brick,
            sessions(mission, brick, vision, [_say_reply, status], _say_sensor),
            port=args.port,
            host=args.host,
            stopped=stopped,
            say=print_line,
            passing=brick.sleep if real_time else None,
        )
        stack.enter_context(closing(server))
        _say_where(server.address, brick.link.transport.address, robot.source, mission)
        server.run()
    print_line("ended; motors off")
    return DONE


def _say_where(served: tuple[str, int], brick: str, camera: str, mission: Mission) -> None:
    from sim_backend.doors.sockets import bracketed, is_loopback

    if not is_loopback(served[0]):
        write_error(f"warning: anyone who can reach {served[0]} can drive this robot.")
    print_line(f"serving {bracketed(served[0])}:{served[1]}")
    print_line(f"brick {brick}, camera {camera}, targets {', '.join(mission.mission.targets)}")
    print_line("Ctrl-C ends it.")


def _say_reply(record: Record) -> None:
    from behaviors.journal import RecordKind

    data = record.data
    if record.kind is RecordKind.REPLY and "argument" in data:  # a mission's own replies have none
        asked = f"{data['verb']} {data['argument']}".rstrip()
        value = "a line of JSON" if isinstance(data["value"], str) else data["value"]
        print_line(f"{record.time_s:8.1f} s  {asked} -> {value}  {data['why']}".rstrip())
        if data["error"]:
            write_error(data["error"])


def _say_sensor(sensor: str, error: str) -> None:
    said = f"continuing without {sensor}: {error}" if error else f"the {sensor} answers again"
    write_error(said)
