"""The picture "lena": a drawing of a woman with a straw hat.

Our own drawing, in the role that a well-known photograph (which is not free) plays in many vision programs. It is
shaded enough for OpenCV's frontal face cascades to take it for a face. Lengths are in millimetres on an A4 sheet.
"""

from __future__ import annotations

import numpy as np

from sim_backend.camera.textures import Color, Image

from .canvas import MIDDLE, SHEET, Canvas, Shape, curve, ellipse, mirrored, polygon, smooth

SKIN: Color = (176, 208, 244)
SKIN_SHADE: Color = (112, 146, 204)
BLUSH: Color = (128, 138, 232)
HAIR: Color = (36, 48, 78)
HAIR_LIGHT: Color = (66, 92, 138)
STRAW: Color = (132, 196, 232)
STRAW_SHADE: Color = (84, 146, 192)
BAND: Color = (122, 62, 110)
LASH: Color = (28, 32, 46)

FACE = smooth(
    (105, 242), (84, 237), (66, 221), (54, 196), (48, 166), (48, 134), (56, 104), (80, 88), (105, 84),
    (130, 88), (154, 104), (162, 134), (162, 166), (156, 196), (144, 221), (126, 237),
)  # fmt: skip


def draw_lena() -> Image:
    """Draw the portrait, A4, 420 x 594 pixels."""
    canvas = Canvas((150, 152, 98))
    _background(canvas)
    _hair_behind(canvas)
    _shoulders(canvas)
    _face(canvas)
    for side in (1, -1):
        _eye(canvas, side)
    _nose(canvas)
    _mouth(canvas)
    _hair_before(canvas)
    _hat(canvas)
    return canvas.picture()


def _background(canvas: Canvas) -> None:
    """Draw a plain room: a wall, a bright window edge, the shadow of a curtain."""
    canvas.gradient(SHEET, (168, 172, 120), (110, 116, 70))
    canvas.fill(polygon((0, 0), (34, 0), (22, 297), (0, 297)), (196, 214, 190), opacity=0.8, soft_mm=2)
    canvas.fill(polygon((176, 0), (210, 0), (210, 297), (188, 297)), (70, 84, 60), opacity=0.6, soft_mm=4)


def _hair_behind(canvas: Canvas) -> None:
    hair = smooth(
        (105, 70), (62, 78), (38, 112), (32, 160), (30, 210), (18, 250), (26, 290), (60, 300), (105, 296),
        (150, 300), (184, 290), (192, 250), (180, 210), (178, 160), (172, 112), (148, 78),
    )  # fmt: skip
    canvas.fill(hair, HAIR)
    for shift in range(0, 26, 4):
        for side in (1, -1):
            x = MIDDLE + side * (58 + shift * 0.75)
            lock = curve((x, 120), (x + side * 3, 165), (x - side * 1, 210), (x + side * (4 + shift * 0.3), 292))
            canvas.stroke(lock, HAIR_LIGHT, 1.6, opacity=0.5, soft_mm=0.5, inside=hair)


def _shoulders(canvas: Canvas) -> None:
    neck = smooth((80, 215), (78, 262), (62, 280), (105, 296), (148, 280), (132, 262), (130, 215))
    canvas.fill(neck, SKIN)
    canvas.fill(ellipse(105, 238, 36, 20), SKIN_SHADE, opacity=0.95, soft_mm=5, inside=neck)
    left = smooth((78, 262), (52, 270), (18, 278), (-8, 300), (60, 312), (105, 308), (92, 288))
    for dress in (left, mirrored(left)):
        canvas.fill(dress, (140, 84, 74))
        canvas.stroke(dress[:80], (176, 122, 110), 2.5, opacity=0.6, soft_mm=1.2, inside=dress)


def _face(canvas: Canvas) -> None:
    """Draw skin with the light from the upper left: shaded rim, eye sockets, cheeks."""
    canvas.fill(FACE, SKIN)
    canvas.stroke(np.concatenate([FACE, FACE[:1]]), SKIN_SHADE, 12, opacity=0.75, soft_mm=6, inside=FACE)
    canvas.fill(ellipse(160, 175, 13, 60), SKIN_SHADE, opacity=0.5, soft_mm=7, inside=FACE)
    canvas.fill(ellipse(105, 118, 34, 13), (198, 226, 252), opacity=0.7, soft_mm=7, inside=FACE)
    for side in (1, -1):
        canvas.fill(ellipse(MIDDLE + side * 29, 151, 19, 11.5), (96, 122, 176), opacity=0.75, soft_mm=4)
        canvas.fill(ellipse(MIDDLE + side * 33, 186, 15, 11), BLUSH, opacity=0.55, soft_mm=6)
        canvas.fill(ellipse(MIDDLE + side * 30, 176, 14, 6), (200, 226, 252), opacity=0.6, soft_mm=3.5)


def _eye(canvas: Canvas, side: int) -> None:
    """Draw one eye, for the right half of the picture; side -1 mirrors it. Both look at the viewer."""

    def at(shape: Shape) -> Shape:
        return shape if side == 1 else mirrored(shape)

    x, y = MIDDLE + 29.0, 153.0
    white = at(
        smooth((x - 15, y + 3), (x - 8, y - 4.5), (x + 2, y - 7), (x + 15, y - 1.5), (x + 7, y + 5.5), (x - 5, y + 6.5))
    )
    canvas.fill(white, (222, 230, 234))
    canvas.fill(at(ellipse(x, y - 0.5, 7.4, 7.4)), (44, 72, 104), inside=white)
    canvas.fill(at(ellipse(x, y - 0.5, 3.8, 3.8)), (14, 16, 20), inside=white)
    canvas.fill(ellipse(MIDDLE + side * 29.0 - 2.6, y - 3.4, 1.8, 1.8), (252, 252, 252))
    lid = at(curve((x - 16, y + 4), (x - 8, y - 5), (x + 2, y - 7.8), (x + 12, y - 4), (x + 19, y - 4.5)))
    canvas.stroke(lid, LASH, 3.2)
    canvas.stroke(at(curve((x - 10, y - 9), (x + 2, y - 12.5), (x + 15, y - 8))), (84, 108, 160), 1.4, opacity=0.8)
    canvas.stroke(at(curve((x - 8, y + 6.6), (x + 3, y + 7.2), (x + 13, y + 2))), (70, 84, 120), 1.2, opacity=0.8)
    brow = at(
        smooth(
            (x - 17, y - 18), (x - 4, y - 23.5), (x + 8, y - 24), (x + 21, y - 16), (x + 8, y - 20.5), (x - 5, y - 18.5)
        )
    )
    canvas.fill(brow, (34, 46, 72), opacity=0.9, soft_mm=0.4)


def _nose(canvas: Canvas) -> None:
    canvas.stroke(curve((115, 150), (114, 172), (119, 188)), SKIN_SHADE, 5, opacity=0.55, soft_mm=2.5)
    canvas.stroke(curve((97, 156), (97, 172), (92, 188)), SKIN_SHADE, 3, opacity=0.3, soft_mm=2)
    canvas.stroke(curve((104, 146), (104, 168), (104, 184)), (206, 232, 254), 6, opacity=0.7, soft_mm=2.2)
    canvas.fill(ellipse(105, 198, 12, 3.5), SKIN_SHADE, opacity=0.75, soft_mm=1.8)
    for side in (1, -1):
        canvas.fill(ellipse(MIDDLE + side * 6.2, 194.6, 3.4, 1.7, side * 16), (58, 72, 120))
        canvas.stroke(
            curve((MIDDLE + side * 11, 187), (MIDDLE + side * 13.6, 192), (MIDDLE + side * 10.4, 196)),
            (88, 112, 172), 1.3, opacity=0.8,
        )  # fmt: skip
    canvas.fill(ellipse(103, 186, 3.6, 2.6), (226, 242, 255), opacity=0.8, soft_mm=1)


def _mouth(canvas: Canvas) -> None:
    """Draw a closed smile."""
    upper = smooth((79, 209), (96, 207.5), (105, 210), (114, 207.5), (131, 209), (119, 216), (105, 218.5), (91, 216))
    lower = smooth((81, 211), (92, 216.5), (105, 219), (118, 216.5), (129, 211), (120, 223.5), (105, 228), (90, 223.5))
    canvas.fill(ellipse(105, 232, 17, 3), SKIN_SHADE, opacity=0.7, soft_mm=2)
    canvas.fill(lower, (96, 92, 204))
    canvas.fill(upper, (70, 62, 164))
    canvas.fill(ellipse(102, 222.5, 10, 2), (170, 168, 240), opacity=0.8, soft_mm=1)
    canvas.stroke(
        curve((77, 207.5), (80, 210), (92, 216), (105, 218.5), (118, 216), (130, 210), (133, 207.5)), (38, 32, 84), 1.5
    )
    for side in (1, -1):
        canvas.fill(ellipse(MIDDLE + side * 29, 207.5, 2.6, 2.6), SKIN_SHADE, opacity=0.7, soft_mm=1)


def _hair_before(canvas: Canvas) -> None:
    """Draw two waves that frame the face from under the hat and fall over the shoulders."""
    wave = smooth(
        (150, 84), (166, 104), (176, 150), (173, 196), (186, 244), (180, 280), (168, 290), (164, 262), (157, 212),
        (162, 170), (156, 130), (142, 104),
    )  # fmt: skip
    for side, shape in ((1, wave), (-1, mirrored(wave))):
        canvas.fill(shape, HAIR)
        for shift in (0.0, 5.0, 10.0):
            x = MIDDLE + side * (57 + shift)
            lock = curve(
                (x - side * 8, 106),
                (x + side * 2, 145),
                (x, 185),
                (x + side * 5, 225),
                (x + side * (shift / 2 + 6), 284),
            )
            canvas.stroke(lock, HAIR_LIGHT, 1.5, opacity=0.8, soft_mm=0.4, inside=shape)


def _hat(canvas: Canvas) -> None:
    """Draw a straw hat with a violet ribbon and a feather; its shadow falls on the forehead."""
    brim = smooth(
        (-12, 112), (14, 84), (60, 70), (105, 66), (150, 70), (196, 84), (222, 112), (170, 106), (105, 100), (40, 106)
    )
    crown = smooth((54, 84), (58, 40), (76, 16), (105, 9), (134, 16), (152, 40), (156, 84), (105, 92))
    shadow = smooth((40, 106), (105, 98), (170, 106), (150, 114), (105, 109), (60, 114))
    canvas.fill(shadow, (70, 92, 140), opacity=0.6, soft_mm=2.5)
    canvas.fill(brim, STRAW)
    canvas.stroke(
        curve((-12, 112), (40, 106), (105, 100), (170, 106), (222, 112)), STRAW_SHADE, 5, soft_mm=2, inside=brim
    )
    canvas.fill(crown, STRAW)
    canvas.fill(ellipse(140, 54, 18, 46), STRAW_SHADE, opacity=0.8, soft_mm=9, inside=crown)
    weave = [curve((40, y), (105, y + 8), (170, y)) for y in np.arange(6, 100, 5.0)]
    for line in weave:
        canvas.stroke(line, STRAW_SHADE, 0.9, opacity=0.7, inside=crown)
    for shift in np.arange(5, 30, 5.5):
        line = curve(
            (-14, 108 - shift * 0.7), (40, 104 - shift), (105, 98 - shift), (170, 104 - shift), (224, 108 - shift * 0.7)
        )
        canvas.stroke(line, STRAW_SHADE, 0.9, opacity=0.6, inside=brim)
    band = smooth(
        (53, 66), (78, 75), (105, 77), (132, 75), (157, 66), (158, 86), (132, 95), (105, 97), (78, 95), (52, 86)
    )
    canvas.fill(band, BAND)
    canvas.fill(ellipse(84, 82, 14, 9), (176, 110, 160), opacity=0.6, soft_mm=4, inside=band)
    _feather(canvas)


def _feather(canvas: Canvas) -> None:
    feather = smooth((150, 88), (164, 62), (186, 40), (203, 34), (200, 52), (188, 72), (168, 90))
    canvas.fill(feather, (166, 92, 148))
    spine = curve((148, 92), (166, 70), (184, 50), (203, 34))
    for share in np.linspace(0.15, 0.95, 14):
        x, y = spine[int(share * (len(spine) - 1))]
        canvas.stroke(polygon((x, y), (x + 9, y - 3)), (196, 134, 184), 0.8, inside=feather)
        canvas.stroke(polygon((x, y), (x - 1, y - 10)), (196, 134, 184), 0.8, inside=feather)
    canvas.stroke(spine, (116, 56, 100), 1.6)
