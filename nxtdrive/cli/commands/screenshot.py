"""``nxtdrive screenshot``: saves the brick's display as an image file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, number
from nxtdrive.cli.output import write_json, write_line
from nxtdrive.host.writing import writing

if TYPE_CHECKING:
    from nxtdrive.onboard.display import Pixels

DESCRIPTION = """\
Save what a brick's display shows, 100 x 64 pixels, each drawn as a square.
The image comes from the firmware's memory. The simulated brick's display shows
what programs and telegrams have drawn, but no menus."""
EXAMPLES = """\
  nxtdrive screenshot /tmp/nxt.png
  nxtdrive screenshot nxt.png --nxt usb:// --scale 8"""

GLASS, INK = (168, 196, 182), (40, 34, 32)
"""Blue, green, red of a clear and of a black pixel, as on the brick."""
MAX_SCALE = 64


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("out", metavar="OUT.png", type=Path, help="image file to write; its suffix chooses the format")
    parser.add_argument(
        "--scale", metavar="N", type=number("scale", int, 1, MAX_SCALE), default=4, help="size of a pixel (default: 4)"
    )
    add_brick_arguments(parser)
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Read the display and write the file."""
    from nxtdrive.brick import open_brick
    from nxtdrive.onboard.display import read_display

    with open_brick(args.nxt) as brick:
        image = read_display(brick.link)
        address = brick.link.transport.address
    _save(image, args.scale, args.out)
    height, width = (side * args.scale for side in image.shape)
    if args.json:
        write_json({"address": address, "file": str(args.out), "width": width, "height": height})
    else:
        write_line(f"{args.out}: {width} x {height}")
        if not image.any():
            write_line(
                "The display is blank: a simulated brick shows what programs and telegrams draw, not LEGO's menus."
            )
    return DONE


def _save(image: Pixels, scale: int, path: Path) -> None:
    import numpy as np

    from nxtdrive.recording.output_file import write_image

    colored = np.where(image[:, :, None], np.array(INK, np.uint8), np.array(GLASS, np.uint8))
    enlarged = colored.repeat(scale, axis=0).repeat(scale, axis=1)
    with writing(path):
        write_image(path, enlarged)
