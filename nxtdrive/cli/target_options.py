"""Arguments that say which target a detector looks for: one of a mission, or one described on the command line."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import add_robot_argument, number, target_height_mm

if TYPE_CHECKING:
    from collections.abc import Mapping

    from behaviors.mission.robot import CameraTable, ColorName, ColorTable
    from nxtdrive.vision.detection import TargetDetector

NETWORK_KEYS = ("label", "labels", "layout", "runtime", "size", "colors", "normalisation", "min_score")
"""Keys of a mission's target with a neural network that have an option of the same name."""


def add_target_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the kinds of targets and their options."""
    from behaviors.mission.robot import ColorName
    from behaviors.mission.targets import MarkerFamily

    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument("--target", metavar="NAME", help="a target of a mission (of the built-in one: lena, rilakkuma)")
    target.add_argument("--picture", metavar="FILE", nargs="+", help="photographs of something flat")
    target.add_argument("--haar", metavar="NAME", help="an OpenCV cascade, or an XML file")
    target.add_argument(
        "--marker", metavar="ID", type=number("id", int, 0, math.inf), help="the number of a printed marker"
    )
    target.add_argument("--qr", metavar="TEXT", help="a QR code with this text")
    target.add_argument("--color", metavar="C", help=", ".join(get_args(ColorName)))
    target.add_argument("--onnx", metavar="FILE", help="a neural network, with --label")
    parser.add_argument(
        "--family",
        choices=get_args(MarkerFamily),
        help="kind of the --marker (default: aruco_4x4_50, which has the numbers 0 to 49; apriltag_36h11 has 0 to 586)",
    )
    _add_network_arguments(parser)
    parser.add_argument(
        "--mission", metavar="FILE", type=Path, help="where --target and the simulated room are described"
    )
    add_robot_argument(parser)
    parser.add_argument(
        "--height-mm",
        metavar="MM",
        type=target_height_mm,
        help="real height of the target, 10 to 3000 (default: 150 for a marker and 160 for a QR code, as "
        "`nxtdrive mission new` prints them; a usual one for --haar and --onnx; else 297, an upright sheet of A4)",
    )


def _add_network_arguments(parser: argparse.ArgumentParser) -> None:
    from behaviors.mission.targets import OnnxColors, OnnxLayout, OnnxNormalisation, OnnxRuntime

    network = parser.add_argument_group("with --onnx, as the keys of a mission's target")
    network.add_argument("--label", metavar="NAME", help="which of the network's labels to look for")
    network.add_argument("--labels", metavar="FILE", help="its labels, one per line, if the network does not name them")
    network.add_argument(
        "--layout", choices=get_args(OnnxLayout), help="how its outputs are arranged, if that is not recognised"
    )
    network.add_argument(
        "--runtime", choices=get_args(OnnxRuntime), help="what runs it (default: onnxruntime if that is installed)"
    )
    network.add_argument(
        "--size",
        metavar="PIXELS",
        type=number("size", int, 1, math.inf),
        help="width and height of its input if it leaves them open, a multiple of 32 (default: 416)",
    )
    usual = "(default: as usual with the layout)"
    network.add_argument("--colors", choices=get_args(OnnxColors), help=f"order of the colours {usual}")
    network.add_argument(
        "--normalisation", choices=get_args(OnnxNormalisation), help=f"0 to 255, 0 to 1, or as for ImageNet {usual}"
    )
    network.add_argument(
        "--min-score",
        metavar="SCORE",
        type=number("score", float, 0, 1),
        help="minimum score of a detection, between 0 and 1 (default: 0.4)",
    )


@dataclass(frozen=True, slots=True)
class ChosenTarget:
    """What a detector looks for.

    Attributes:
        name: The target's name.
        detector: Finds it.
        camera: As the mission or the robot file describes it.
        pictures: The files of its photographs.
    """

    name: str
    detector: TargetDetector
    camera: CameraTable
    pictures: Sequence[str]


def chosen_target(args: argparse.Namespace) -> ChosenTarget:
    """Return the target.

    Raises:
        ConfigError: There is no such target, or an option does not fit it.
    """
    from nxtdrive.mission.files import default_robot_file, read_robot_file
    from nxtdrive.vision.detectors import make_detector

    if args.mission and args.target is None:
        raise ConfigError("--mission needs --target.", remedy="Name the target of the mission to look for.")
    for key in NETWORK_KEYS:
        if getattr(args, key) is not None and args.onnx is None:
            option = f"--{key.replace('_', '-')}"
            raise ConfigError(f"{option} needs --onnx.", remedy="Name the file of the neural network.")
    if args.family is not None and args.marker is None:
        raise ConfigError("--family needs --marker.", remedy="Give the marker's number.")
    if args.target is not None:
        spec, camera = _of_mission(args)
        name = args.target
    else:
        robot = read_robot_file(args.robot or default_robot_file())
        (name, spec), camera = _described(args, robot.color), robot.camera
    if args.height_mm is not None:
        spec["height_mm"] = args.height_mm
    pictures = spec.get("pictures")
    return ChosenTarget(name, make_detector(spec), camera, pictures if isinstance(pictures, list) else ())


def height_source(args: argparse.Namespace) -> str:
    """Return in words where the height of a target comes from that was not given."""
    if args.marker is not None or args.qr is not None:
        return "as `nxtdrive mission new` prints it"
    if args.onnx is None and args.haar is None:
        return "that of an upright sheet of A4"
    from behaviors.mission.usual_heights import USUAL_HEIGHTS_MM, cascade_label

    label = args.label or cascade_label(args.haar)
    return f"as is usual for {label!r}" if label.casefold() in USUAL_HEIGHTS_MM else "a guess"


def _of_mission(args: argparse.Namespace) -> tuple[dict[str, object], CameraTable]:
    """Return the specification of a mission's target, and the camera."""
    from nxtdrive.mission.detectors import detector_spec
    from nxtdrive.mission.files import read_mission_file

    mission = read_mission_file(args.mission, args.robot)
    if args.target not in mission.target:
        raise ConfigError(
            f"the mission describes no target {args.target!r}.", remedy=f"It has: {', '.join(mission.target)}."
        )
    return detector_spec(mission.target[args.target], mission.color), mission.camera


def _described(args: argparse.Namespace, colors: Mapping[ColorName, ColorTable]) -> tuple[str, dict[str, object]]:
    """Return name and specification of a target that is described on the command line."""
    from behaviors.mission.usual_heights import cascade_label, default_height_mm
    from nxtdrive.vision.geometry import MARKER_HEIGHT_MM, QR_HEIGHT_MM

    if args.picture is not None:
        return Path(args.picture[0]).stem, {"detector": "picture", "pictures": args.picture}
    if args.haar is not None:
        height_mm = default_height_mm(cascade_label(args.haar))
        return "haar", {"detector": "haar", "cascade": args.haar, "height_mm": height_mm}
    if args.marker is not None:
        spec = {"detector": "marker", "id": args.marker, "height_mm": MARKER_HEIGHT_MM}
        return f"marker {args.marker}", spec | ({"family": args.family} if args.family else {})
    if args.qr is not None:
        return f"QR {args.qr}", {"detector": "qr", "text": args.qr, "height_mm": QR_HEIGHT_MM}
    if args.onnx is not None:
        return _network(args)
    shade = colors.get(args.color)
    return args.color, {"detector": "color", "color": args.color, **(shade.model_dump() if shade else {})}


def _network(args: argparse.Namespace) -> tuple[str, dict[str, object]]:
    """Return name and specification of a target that a neural network finds."""
    from behaviors.mission.usual_heights import default_height_mm

    if args.label is None:
        from nxtdrive.vision.detectors.onnx_labels import listed
        from nxtdrive.vision.detectors.onnx_model import labels_of

        known = listed(labels_of(Path(args.onnx), args.labels)) or "it names none, so give a number, such as 0"
        raise ConfigError("--onnx needs --label.", remedy=f"The labels of {args.onnx}: {known}.")
    given = {key: value for key in NETWORK_KEYS if (value := getattr(args, key)) is not None}
    return args.label, {"detector": "onnx", "model": args.onnx, "height_mm": default_height_mm(args.label), **given}
