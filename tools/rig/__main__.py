"""``python -m tools.rig``: a virtual test bench with a stock Linux kernel; see docs/hil.md."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Sequence

from . import camera
from .errors import RigError
from .rig import Rig, forget

EXAMPLES = """\
  python -m tools.rig up --world arena
  python -m tools.rig exec nxtdrive doctor
  python -m tools.rig exec nxtdrive run --nxt usb:// --camera 0 --no-video
  python -m tools.rig fault usb unplug 5
  python -m tools.rig fault usb halt in
  python -m tools.rig fault bluetooth vanish 5
  python -m tools.rig fault camera cover 5
  python -m tools.rig camera
  python -m tools.rig truth
  python -m tools.rig down"""

FAULTS = {"usb": ("unplug", "halt", "mute"), "camera": ("unplug", "cover"), "bluetooth": ("vanish",)}
ENDPOINTS = {"out": 0x01, "in": 0x82}


def main(argv: Sequence[str] | None = None) -> int:
    """Parse the command line and run the action."""
    args = _arguments(argv)
    try:
        return int(args.run(args))
    except RigError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tools.rig",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    up = actions.add_parser("up", help="boot the guest with brick and webcam plugged in")
    up.add_argument("--world", default="open", help="a world file or the name of a bundled world")
    up.add_argument("--seed", type=int, default=0, help="random seed (default: 0)")
    up.add_argument("--size", metavar="WxH", default="320x240", help="of the webcam's frames (default: 320x240)")
    up.set_defaults(run=_up)
    execute = actions.add_parser("exec", help="run a command in the guest, as root")
    execute.add_argument("--timeout", metavar="S", type=float, default=300.0, help="time limit (default: 300)")
    execute.add_argument("command", metavar="COMMAND", nargs=argparse.REMAINDER)
    execute.set_defaults(run=_exec)
    fault = actions.add_parser("fault", help="make a fault")
    fault.add_argument("device", choices=FAULTS)
    fault.add_argument("kind", choices=("unplug", "halt", "mute", "vanish", "cover"))
    fault.add_argument("value", help="seconds; for halt the endpoint, in or out")
    fault.set_defaults(run=_fault)
    actions.add_parser("camera", help="measure frames per second and latency in the guest").set_defaults(run=_camera)
    actions.add_parser("truth", help="print the world's truth").set_defaults(run=_truth)
    actions.add_parser("down", help="end it").set_defaults(run=_down)
    return parser.parse_args(argv)


def _up(args: argparse.Namespace) -> int:
    start = time.monotonic()
    rig = Rig.start(args.world, seed=args.seed, size=args.size)
    rig.save()
    print(f"up after {time.monotonic() - start:.1f} s; brick and webcam are plugged in")
    return 0


def _exec(args: argparse.Namespace) -> int:
    def show(kind: str, text: str) -> None:
        stream = sys.stdout if kind == "out" else sys.stderr
        stream.write(text)
        stream.flush()

    return Rig.running().run(shlex.join(args.command), timeout_s=args.timeout, show=show).code


def _fault(args: argparse.Namespace) -> int:
    if args.kind not in FAULTS[args.device]:
        raise RigError(f"{args.device} has no such fault. It has: {', '.join(FAULTS[args.device])}.")
    if (args.kind == "halt") != (args.value in ENDPOINTS):
        raise RigError("Give in or out for halt, seconds for the others.")
    rig = Rig.running()
    if args.kind == "halt":
        rig.fault(halt=ENDPOINTS[args.value])
        return 0
    seconds = float(args.value)
    if args.kind in ("mute", "cover"):
        rig.fault(**{args.kind: True})
        time.sleep(seconds)
        rig.fault(**{args.kind: False})
    elif args.kind == "vanish":
        rig.fault(radio="vanish")
        time.sleep(seconds)
        rig.fault(radio="return")
    else:
        rig.fault(unplug=args.device)
        time.sleep(seconds)
        rig.plug(args.device)
    return 0


def _camera(_: argparse.Namespace) -> int:
    figures = camera.measure(Rig.running())
    print(f"{figures.frames_per_s:.1f} frames a second")
    print(f"latency {figures.latency_s * 1000:.0f} ms, at most {figures.longest_s * 1000:.0f} ms, of {camera.COVERS}")
    return 0


def _truth(_: argparse.Namespace) -> int:
    for name, value in Rig.running().truth().items():
        print(f"{name:17} {value}")
    return 0


def _down(_: argparse.Namespace) -> int:
    rig = Rig.running()
    rig.stop()
    forget()
    return 0


if __name__ == "__main__":
    sys.exit(main())
