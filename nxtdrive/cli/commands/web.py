"""``nxtdrive web``: a page in the browser to watch and to drive the robot."""

from __future__ import annotations

import argparse
import os
import socket
import sys
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from input_files.plain import whole_number
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import DEFAULT_ADDRESS
from nxtdrive.cli.output import print_line
from nxtdrive.cli.page_options import (
    add_port_argument,
    add_server_arguments,
    make_robot,
    missions_folder,
    require_page,
)
from nxtdrive.host.listening import LOOPBACK, listen

if TYPE_CHECKING:
    from nxtdrive.tools.web.access import Pin

DESCRIPTION = """\
Watch and drive the robot in the browser: camera, map, statechart, missions, and a
pad that works on a phone. Without a brick it opens the simulated one in real time.
For one robot it uses the robot.toml in the folder of the missions if no other robot
file is named. Needs the extra nxtdrive[web]. Only this computer can open the page;
with --lan phones and other computers can too, with the PIN that is printed here.
The file of --classroom is TOML: for each robot a table [[robot]] with its name and, if
it is not simulated, nxt = "usb://0016530A1B2C"; also camera, mission and color."""
EXAMPLES = """\
  nxtdrive web
  nxtdrive web --nxt usb:// --camera 0
  nxtdrive web --lan
  nxtdrive web --classroom 12            # twelve simulated robots
  nxtdrive web --classroom 12 --mission my-mission.toml     # in its room
  nxtdrive web --classroom classroom.toml --lan
  nxtdrive web --nxt "sim://open?seed=3" --port 8000"""

ENDED = "ended; motors off"
EVERYWHERE = "0.0.0.0"  # noqa: S104 - only with --lan, and behind a PIN
ELSEWHERE = ("192.0.2.1", 9)
"""An address for documentation (RFC 5737): the route to it gives this computer's own address; nothing is sent."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    add_server_arguments(parser, "folder with the mission files that the page offers")
    parser.add_argument(
        "--classroom",
        metavar="FILE",
        help="serve one page for all robots that this file lists, and a page for each of them; give a number for that "
        "many simulated robots, in the room of --mission if that is given",
    )
    add_port_argument(parser, "TCP port")
    parser.add_argument(
        "--lan", action="store_true", help="let phones and other computers on the network in, with the printed PIN"
    )


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C; return the exit code."""
    require_page()
    from nxtdrive.tools.web.access import Pin

    serve = _serve_classroom if args.classroom else _serve_robot
    busy = serve(args, Pin() if args.lan else None)
    print_line(f"ended; no answer from {', '.join(busy)}, whose brick stops its motors itself" if busy else ENDED)
    return DONE


def _serve_robot(args: argparse.Namespace, pin: Pin | None) -> list[str]:
    """Serve the page of one robot; return its name if it could not be closed."""
    from nxtdrive.mission.files import ROBOT_FILE, read_mission_file, robot_file_of
    from nxtdrive.tools.web.app import Server, serve
    from nxtdrive.tools.web.calibration import Calibrations
    from nxtdrive.tools.web.hub import Hub
    from nxtdrive.tools.web.runs import Runs

    hub = Hub()
    robot, missions = make_robot(args, hub)
    robot_file = args.robot or robot_file_of(missions.folder) or missions.folder / ROBOT_FILE

    def use(file: Path) -> None:
        missions.use(file)
        robot.rebuild(read_mission_file(args.mission, file))

    with (
        closing(listen(args.port, LOOPBACK if pin is None else EVERYWHERE)) as listener,
        closing(robot),
        suppress(KeyboardInterrupt),
    ):
        server = Server(
            robot, hub, missions, Runs(args.out), str(robot.address), pin, Calibrations(hub, robot_file, use)
        )
        serve(server, robot, listener, lambda: _announce(listener.getsockname()[1], pin))
    if robot.failure:
        raise robot.failure
    return ["the robot"] if robot.alive else []


def _serve_classroom(args: argparse.Namespace, pin: Pin | None) -> list[str]:
    """Serve the pages of a classroom; return the names of the robots that could not be closed.

    Raises:
        ConfigError: The classroom's file has mistakes.
    """
    from nxtdrive.mission.files import read_mission_file
    from nxtdrive.recording.run_folder import check_parent
    from nxtdrive.tools.web.classroom.app import ClassroomServer, serve_classroom
    from nxtdrive.tools.web.classroom.classroom import Classroom
    from nxtdrive.tools.web.classroom.config import read_classroom, simulated_classroom

    check_parent(args.out)
    if args.camera or args.nxt != (os.environ.get("NXT") or DEFAULT_ADDRESS):
        raise ConfigError(
            "--nxt, --camera and --trace are for one robot.",
            remedy="Leave them out; the file of --classroom names bricks and cameras.",
        )
    if (count := whole_number(args.classroom)) is not None:
        config = simulated_classroom(count, missions_folder(args), args.out, args.mission)
    else:
        config = read_classroom(Path(args.classroom), missions_folder(args), args.out)
    classroom = Classroom(config, read_mission_file(args.mission, args.robot), args.robot)
    with (
        closing(listen(args.port, LOOPBACK if pin is None else EVERYWHERE)) as listener,
        closing(classroom),
        suppress(KeyboardInterrupt),
    ):
        serve_classroom(ClassroomServer(classroom, pin), listener, lambda: _announce(listener.getsockname()[1], pin))
    return [station.entry.name for station in classroom.stations if station.alive]


def _announce(port: int, pin: Pin | None) -> None:
    """Print where the page is, and for other computers also as a QR code and with the PIN."""
    url = f"http://{LOOPBACK if pin is None else _own_address()}:{port}/"
    print_line(f"{url}  (Ctrl-C ends it)")
    if pin is None:
        return
    from nxtdrive.tools.web.qr import qr_code

    if _can_print(code := qr_code(url)):
        for line in code.splitlines():
            print_line(line)
    print_line(f"PIN {pin.digits}")


def _can_print(text: str) -> bool:
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True


def _own_address() -> str:
    """Return this computer's address in the network, or its name without a route out of the network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(ELSEWHERE)
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])
