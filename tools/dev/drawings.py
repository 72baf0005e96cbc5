"""Draw the pictures that a simulated robot searches for, and decoys.

All are our own drawings. They ship as PNG files in `sim_backend/pictures/`, A4 upright, 2 pixels per millimetre, and
can be printed at full size for a real room. After a change here, write the files again, in a checkout::

    python -m tools.dev.drawings
"""

from __future__ import annotations

from collections.abc import Callable

import cv2

from sim_backend.bundled import PICTURES
from sim_backend.camera.textures import Color, Image

from .canvas import MIDDLE, SHEET, Canvas, Shape, curve, ellipse, mirrored, polygon, smooth
from .portrait import draw_lena
from .prints import draw_logo, draw_sunset
from .program import parser

FUR: Color = (52, 104, 168)
FUR_SHADE: Color = (36, 76, 130)
CREAM: Color = (176, 214, 240)
INK: Color = (26, 30, 40)


def draw_rilakkuma() -> Image:
    """Draw a brown cartoon bear with a striped scarf and a honey pot, named as the thesis named its bear."""
    canvas = Canvas((180, 214, 190))
    canvas.gradient(SHEET, (214, 226, 176), (170, 206, 150))
    canvas.fill(ellipse(105, 130, 98, 98), (170, 176, 96), opacity=0.9)
    canvas.fill(polygon((0, 262), (210, 252), (210, 297), (0, 297)), (96, 168, 110))
    _bear_body(canvas)
    _bear_head(canvas)
    _scarf(canvas)
    _honey_pot(canvas)
    return canvas.picture()


def draw_fox() -> Image:
    """Draw a decoy: another cartoon animal of a similar build, an orange fox with its tail around its feet."""
    canvas = Canvas((236, 214, 220))
    canvas.gradient(SHEET, (226, 196, 206), (196, 162, 190))
    canvas.fill(polygon((0, 250), (210, 262), (210, 297), (0, 297)), (150, 116, 140))
    orange, shade, white = (48, 122, 236), (36, 88, 190), (244, 246, 248)
    tail = smooth((120, 276), (176, 282), (200, 246), (194, 196), (176, 176), (172, 208), (158, 244), (112, 262))
    canvas.fill(tail, orange)
    canvas.fill(smooth((194, 196), (176, 172), (170, 210), (182, 214), (188, 222), (198, 214)), white)
    body = smooth((105, 160), (74, 186), (58, 240), (66, 282), (105, 288), (144, 282), (152, 240), (136, 186))
    canvas.fill(body, orange)
    canvas.fill(smooth((105, 176), (88, 198), (92, 240), (105, 256), (118, 240), (122, 198)), white)
    for side in (1, -1):
        canvas.stroke(curve((MIDDLE + side * 12, 226), (MIDDLE + side * 14, 280)), shade, 2.5)
        canvas.fill(ellipse(MIDDLE + side * 24, 281, 17, 9), (60, 56, 70))
        ear = smooth(
            (MIDDLE + side * 20, 82), (MIDDLE + side * 58, 22), (MIDDLE + side * 68, 92), (MIDDLE + side * 44, 110)
        )
        canvas.fill(ear, orange)
        canvas.fill(ellipse(MIDDLE + side * 53, 64, 9, 22, side * 10), (70, 60, 80))
    head = smooth(
        (105, 76), (62, 86), (34, 128), (50, 150), (84, 170), (105, 184), (126, 170), (160, 150), (176, 128), (148, 86)
    )
    canvas.fill(head, orange)
    canvas.fill(ellipse(164, 116, 20, 50), shade, opacity=0.6, soft_mm=8, inside=head)
    cheek = smooth((111, 150), (132, 132), (160, 128), (184, 122), (160, 152), (126, 172), (105, 186))
    for white_cheek in _both(cheek):
        canvas.fill(white_cheek, white, inside=head)
    for side in (1, -1):
        x = MIDDLE + side * 29
        canvas.stroke(curve((x - 10, 122), (x, 114), (x + 10, 122)), INK, 4)
    canvas.fill(ellipse(105, 174, 10, 8), INK)
    canvas.fill(ellipse(102, 171, 3, 1.8), (170, 170, 176))
    return canvas.picture()


def draw_landscape() -> Image:
    """Draw a decoy: hills, a lake, a sailing boat and the evening sun."""
    canvas = Canvas((220, 180, 140))
    canvas.gradient(polygon((0, 0), (210, 0), (210, 170), (0, 170)), (196, 132, 74), (150, 206, 250))
    canvas.fill(ellipse(150, 104, 40, 40), (180, 226, 255), opacity=0.6, soft_mm=10)
    canvas.fill(ellipse(150, 104, 19, 19), (150, 220, 255))
    for x, y, size in ((46, 44, 1.0), (120, 28, 0.7), (182, 56, 0.8)):
        for dx, dy, radius in ((-18, 2, 10), (-4, -4, 15), (13, 0, 12), (26, 4, 7)):
            canvas.fill(
                ellipse(x + dx * size, y + dy * size, radius * size * 1.3, radius * size * 0.7),
                (240, 238, 244),
                opacity=0.9,
            )
    canvas.fill(polygon((-5, 150), (22, 128), (38, 136), (76, 84), (120, 144), (146, 150), (215, 176)), (150, 118, 104))
    canvas.fill(polygon((60, 106), (76, 84), (93, 107), (84, 104), (74, 112)), (246, 244, 244))
    canvas.fill(
        smooth((-20, 172), (40, 146), (100, 164), (160, 150), (230, 166), (220, 190), (-10, 190)), (92, 128, 86)
    )
    canvas.gradient(polygon((0, 172), (210, 172), (210, 256), (0, 256)), (178, 160, 110), (132, 96, 48))
    for row, y in enumerate(range(180, 246, 7)):
        for x in range(-10 + 13 * (row % 3), 210, 42):
            canvas.stroke(curve((x, y), (x + 8, y - 1.2), (x + 18, y)), (214, 204, 172), 1.2, opacity=0.7)
    canvas.fill(polygon((66, 158), (66, 206), (34, 206)), (244, 244, 250))
    canvas.fill(polygon((69, 166), (69, 206), (92, 206)), (70, 70, 210))
    canvas.fill(smooth((32, 210), (66, 210), (98, 209), (88, 222), (42, 222)), (44, 66, 104))
    canvas.fill(smooth((-20, 250), (50, 238), (120, 252), (230, 234), (230, 310), (-20, 310)), (60, 132, 88))
    for x, height in ((18, 44), (176, 60), (196, 40)):
        canvas.stroke(curve((x, 282), (x, 282 - height / 2)), (40, 62, 92), 5)
        for level in range(3):
            base = 276 - level * height * 0.38
            canvas.fill(
                polygon((x - 15 + 3 * level, base), (x + 15 - 3 * level, base), (x, base - height * 0.6)), (50, 96, 44)
            )
    return canvas.picture()


PAINTERS: dict[str, Callable[[], Image]] = {
    "lena": draw_lena,
    "rilakkuma": draw_rilakkuma,
    "fox": draw_fox,
    "landscape": draw_landscape,
    "sunset": draw_sunset,
    "logo": draw_logo,
}
"""What draws each picture in `sim_backend/pictures/`."""


def write_pictures() -> None:
    """Draw every picture and write it to `sim_backend/pictures/`."""
    PICTURES.mkdir(exist_ok=True)
    for name, paint in PAINTERS.items():
        cv2.imwrite(str(PICTURES / f"{name}.png"), paint(), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def _both(shape: Shape) -> tuple[Shape, Shape]:
    return shape, mirrored(shape)


def _bear_body(canvas: Canvas) -> None:
    canvas.fill(ellipse(105, 288, 90, 9), (66, 122, 78), opacity=0.8, soft_mm=3)
    body = ellipse(105, 228, 60, 62)
    canvas.fill(body, FUR)
    canvas.fill(ellipse(150, 240, 22, 62), FUR_SHADE, opacity=0.7, soft_mm=8, inside=body)
    canvas.fill(ellipse(105, 244, 38, 42), CREAM)
    for foot in _both(ellipse(153, 276, 25, 20, -24)):
        canvas.fill(foot, FUR_SHADE)
    for sole in _both(ellipse(155, 278, 17, 13, -24)):
        canvas.fill(sole, CREAM)


def _bear_head(canvas: Canvas) -> None:
    for ear in _both(ellipse(155, 62, 23, 23)):
        canvas.fill(ear, FUR)
    for inner in _both(ellipse(154, 64, 13, 13)):
        canvas.fill(inner, (104, 140, 226))
    head = ellipse(105, 112, 72, 60)
    canvas.fill(head, FUR)
    canvas.fill(ellipse(168, 126, 22, 58), FUR_SHADE, opacity=0.7, soft_mm=9, inside=head)
    canvas.fill(ellipse(82, 74, 34, 14, -14), (84, 142, 206), opacity=0.7, soft_mm=6, inside=head)
    muzzle = ellipse(105, 134, 30, 23)
    canvas.fill(muzzle, CREAM)
    canvas.fill(smooth((92, 122), (105, 118), (118, 122), (114, 131), (105, 135), (96, 131)), INK)
    canvas.fill(ellipse(101, 123, 4, 2), (150, 150, 160), opacity=0.8, soft_mm=0.6)
    canvas.stroke(curve((105, 134), (105, 142)), INK, 2.4)
    canvas.stroke(curve((89, 140), (95, 146), (105, 142), (115, 146), (121, 140)), INK, 2.4)
    for side in (1, -1):
        canvas.fill(ellipse(MIDDLE + side * 38, 106, 7.5, 8.5), INK)
        canvas.fill(ellipse(MIDDLE + side * 38 - 2, 103.5, 2.1, 2.1), (250, 250, 250))
        canvas.fill(ellipse(MIDDLE + side * 53, 137, 9, 6.5), (112, 118, 232), opacity=0.6, soft_mm=2.5)
        canvas.stroke(
            curve((MIDDLE + side * 31, 89), (MIDDLE + side * 38, 86), (MIDDLE + side * 44, 89)), FUR_SHADE, 2.6
        )


def _scarf(canvas: Canvas) -> None:
    """Draw a red scarf with white stripes; one end hangs down."""
    loop = smooth(
        (50, 158),
        (76, 172),
        (105, 176),
        (134, 172),
        (160, 158),
        (164, 172),
        (138, 190),
        (105, 195),
        (72, 190),
        (46, 172),
    )
    end = smooth((66, 182), (84, 188), (82, 222), (78, 246), (58, 242), (62, 214))
    for cloth in (end, loop):
        canvas.fill(cloth, (52, 48, 206))
    for y in (196, 209, 222, 235):
        canvas.stroke(curve((52, y), (70, y + 4), (90, y + 4)), (240, 240, 246), 4, inside=end)
    for x in range(52, 168, 17):
        canvas.stroke(curve((x, 150), (x + (105 - x) * 0.1, 200)), (240, 240, 246), 4.5, inside=loop)
    canvas.stroke(
        curve((50, 174), (74, 190), (105, 194), (138, 189), (162, 172)), (36, 32, 150), 2, opacity=0.8, inside=loop
    )


def _honey_pot(canvas: Canvas) -> None:
    pot = smooth((112, 218), (154, 218), (162, 238), (156, 262), (133, 267), (110, 262), (104, 238))
    canvas.fill(pot, (196, 134, 70))
    canvas.fill(ellipse(152, 242, 9, 26), (140, 90, 42), opacity=0.7, soft_mm=4, inside=pot)
    canvas.fill(
        smooth(
            (108, 212),
            (133, 209),
            (158, 212),
            (157, 221),
            (150, 222),
            (146, 232),
            (140, 222),
            (124, 222),
            (119, 229),
            (113, 221),
        ),
        (60, 186, 246),
    )
    bee = ellipse(128, 245, 9, 6, -20)
    for wing in (ellipse(124, 237, 4, 6, -30), ellipse(132, 236, 4, 6, 10)):
        canvas.fill(wing, (244, 240, 236))
    canvas.fill(bee, (60, 196, 250))
    for x in (125, 131):
        canvas.stroke(curve((x - 1, 236), (x + 2, 254)), INK, 2, inside=bee)
    for arm in _both(ellipse(160, 228, 17, 26, 38)):
        canvas.fill(arm, FUR)
        canvas.stroke(arm[20:70], FUR_SHADE, 2, opacity=0.8)


if __name__ == "__main__":
    parser(__doc__).parse_args()
    write_pictures()
