"""``nxtdrive sim``: offers the simulated brick to other programs, in real time."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from input_files.plain import whole_number
from nxtdrive.cli.commands.sim_check import add_check_arguments, check
from nxtdrive.cli.commands.sim_record import add_record_arguments, record
from nxtdrive.cli.options import add_action, add_json_argument, number, tcp_port
from sim_backend.firmware.versions import FIRMWARES

DESCRIPTION = """\
Let any program written for a real brick use the simulated one, in real time.

serve  opens ports until Ctrl-C: a serial port as over Bluetooth, TCP,
       nxt-python's nxt-server, USB/IP; any number at once, all of them
       connected to one brick. Its camera is a stream, or a USB webcam.
exec   runs a program that looks for a brick on USB and finds the simulated one.
check  replays a recorded conversation with a brick and reports differences.
record records a conversation with a real brick, or a simulated one."""
EXAMPLES = """\
  nxtdrive sim serve --pty /tmp/nxt
  nxtdrive sim serve --pty /tmp/nxt --tcp 2728 --nxt-server 2727 --world arena
  nxtdrive sim serve --usbip 3240 --uvc 3241
  nxtdrive sim exec -- nxt-test --backend usb
  nxtdrive sim exec --native -- t2n -i
  nxtdrive sim exec --native --firmware 1.32 -- nbc -EF -S=usb -r drive.nxc
  nxtdrive sim exec --latency-ms 30 -- python my_robot.py
  nxtdrive sim check my-brick.jsonl --firmware 1.05
  nxtdrive sim check my-brick.jsonl --scenario 'motor_*' --causes
  nxtdrive sim record questions.txt --nxt usb:// --out my-brick.jsonl"""

TCP_DOORS = {
    "--tcp": "for tcp://; 0 takes a free port",
    "--nxt-server": "for nxt-python's socket backend",
    "--usbip": "the brick on Linux's USB, by usbip attach (usual port: 3240)",
    "--uvc": "its camera as a USB webcam, by usbip attach (usual port: 3241)",
}
"""Options of the doors that are TCP ports, with their help."""

LATENCY_MS = 1.0
"""The brick polls for telegrams once per millisecond, so no link is faster; programs rely on it (docs/interop.md)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    _add_serve(add_action(actions, "serve", "open serial, TCP and USB/IP ports, and a camera stream", _serve))
    _add_exec(add_action(actions, "exec", "run a program with the simulated brick on USB", _exec))
    checked = "compare the simulated brick with a recorded conversation"
    add_check_arguments(add_action(actions, "check", checked, check))
    recorded = "record a conversation with a brick, for `nxtdrive sim check`"
    add_record_arguments(add_action(actions, "record", recorded, record))


def _add_serve(serve: argparse.ArgumentParser) -> None:
    _add_doors(serve.add_argument_group("how programs connect", "at least one; each may be given several times"))
    serve.add_argument(
        "--camera-port",
        metavar="N",
        type=tcp_port,
        default=0,
        help="port of the stream on 127.0.0.1 (default: a free one)",
    )
    serve.add_argument(
        "--size",
        metavar="WxH",
        type=_size,
        default=(320, 240),
        help="size of the camera's frames; each side 16 to 4096 (default: 320x240)",
    )
    _add_simulation(serve)
    add_json_argument(serve)
    serve.set_defaults(refuse=serve.error)


def _add_doors(doors: argparse._ArgumentGroup) -> None:
    doors.add_argument(
        "--pty",
        metavar="LINK",
        type=Path,
        action="append",
        default=[],
        help="create a serial port (pseudo-terminal) of this name",
    )
    for option, what in TCP_DOORS.items():
        doors.add_argument(option, metavar="PORT", type=tcp_port, action="append", default=[], help=what)
    doors.add_argument(
        "--host", metavar="ADDRESS", default="127.0.0.1", help="local address to listen on (default: 127.0.0.1)"
    )


def _add_exec(execute: argparse.ArgumentParser) -> None:
    _add_simulation(execute)
    execute.add_argument(
        "--native",
        action="store_true",
        help="for any program that uses libusb, by means of umockdev (default: Python programs that use pyusb)",
    )
    execute.add_argument(
        "program", metavar="-- COMMAND", nargs=argparse.REMAINDER, help="the program and its arguments"
    )
    execute.set_defaults(refuse=execute.error)


def _add_simulation(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--world", metavar="FILE", help="a world file or the name of a bundled world (default: arena)")
    parser.add_argument(
        "--seed", metavar="N", type=number("seed", int, 0, math.inf), default=0, help="random seed (default: 0)"
    )
    parser.add_argument(
        "--firmware",
        choices=FIRMWARES,
        default=FIRMWARES[0],
        help=f"LEGO's 1.29 or 1.05, or the community's 1.32, for which NBC and NXC have -EF (default: {FIRMWARES[0]})",
    )
    parser.add_argument(
        "--latency-ms",
        metavar="MS",
        type=number("milliseconds", float, 0, 10_000),
        default=LATENCY_MS,
        help=f"round trip of the link (default: {LATENCY_MS:g}; cable: 2; radio: 30)",
    )
    parser.add_argument(
        "--faults",
        metavar="FILE",
        type=Path,
        help="TOML file of faults to inject on each link, such as drop_replies = [3]; a wrong key names the others",
    )


def _size(text: str) -> tuple[int, int]:
    sides = [whole_number(part) for part in text.lower().split("x")]
    match sides:
        case [int(width), int(height)] if 16 <= width <= 4096 and 16 <= height <= 4096:
            return width, height
    raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, each 16 to 4096; write 320x240")


def _serve(args: argparse.Namespace) -> int:
    if not (args.pty or args.tcp or args.nxt_server or args.usbip or args.uvc):
        args.refuse("say how programs connect: --pty LINK, --tcp PORT, --nxt-server PORT, --usbip PORT or --uvc PORT")
    from nxtdrive.cli.commands.sim_serve import serve

    return serve(args)


def _exec(args: argparse.Namespace) -> int:
    program = args.program[1:] if args.program[:1] == ["--"] else args.program
    if not program:
        args.refuse("name the program to run: nxtdrive sim exec -- COMMAND")
    from nxtdrive.cli.commands.sim_exec import execute

    return execute(args, program)
