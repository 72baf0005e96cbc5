"""Recognise pictures for which a simpler detector than `picture` fits: QR codes, markers, plain colours."""

from __future__ import annotations

import cv2
import numpy as np

from input_files.toml_file import toml_string
from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.color import HUES, MIN_SATURATION, MIN_VALUE, ColorDetector
from nxtdrive.vision.detectors.marker import FAMILIES
from nxtdrive.vision.detectors.qr import LONGEST, text_of

LONG_SIDE_PX = 640
"""A larger picture is reduced to this; a code that fills a good part of it is still recognised."""
MIN_SHARE = 0.15
"""Minimum share of the picture that a code, marker or patch fills: a smaller one is only a part of the scene."""
MIN_COLOR_SHARE = 0.8
"""Minimum share of all that is strongly coloured in the picture: a patch among others is one of many details."""
MAX_PATCH_SD = 15.0
"""Largest standard deviation of the grey levels in the middle of a plain patch."""


def simpler_detector(image: Image) -> str:
    """Return a sentence on the detector that fits a picture better than `picture`; empty if there is none."""
    scale = min(1.0, LONG_SIDE_PX / max(image.shape[:2]))
    size = [max(1, round(scale * side)) for side in image.shape[1::-1]]
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
    margin = max(small.shape[:2]) // 8  # codes and markers are not recognised without white around them
    framed = cv2.copyMakeBorder(small, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    least_px = MIN_SHARE * small.shape[0] * small.shape[1]
    return _qr(framed, least_px) or _marker(framed, least_px) or _color(small, least_px)


def _qr(image: cv2.typing.MatLike, least_px: float) -> str:
    try:
        code, corners, _ = cv2.QRCodeDetectorAruco().detectAndDecodeBytes(image)
    except cv2.error:  # a code in a mode that it does not support, such as that for hanzi
        return ""
    text = text_of(code)
    if not 1 <= len(text) <= LONGEST or cv2.contourArea(corners) < least_px:
        return ""
    keys = f'detector = "qr" and text = {toml_string(text)}'
    return f"the picture shows a QR code: a target with {keys} reads it, and takes nothing else for it"


def _marker(image: cv2.typing.MatLike, least_px: float) -> str:
    for family, (dictionary, _) in FAMILIES.items():
        reader = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary))
        corners, numbers, _ = reader.detectMarkers(image)
        for quad, number in zip(corners, [] if numbers is None else numbers.ravel(), strict=True):
            if cv2.contourArea(quad) >= least_px:
                keys = f'detector = "marker", family = "{family}" and id = {number}'
                return f"the picture shows a marker: a target with {keys} reads it, and takes nothing else for it"
    return ""


def _color(image: Image, least_px: float) -> str:
    hsv, grey = cv2.cvtColor(image, cv2.COLOR_BGR2HSV), cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    strong_px = np.count_nonzero((hsv[..., 1] >= MIN_SATURATION) & (hsv[..., 2] >= MIN_VALUE))
    for color in HUES:
        for patch in ColorDetector(color).detect(image)[:1]:
            left, top, width, height = (round(each) for each in patch.box)
            middle = grey[top + height // 4 : top + height * 3 // 4, left + width // 4 : left + width * 3 // 4]
            plain = float(middle.std()) < MAX_PATCH_SD
            if plain and patch.score * width * height >= max(least_px, MIN_COLOR_SHARE * strong_px):
                keys = f'detector = "color" and color = "{color}"'
                return f"the picture shows something plain {color}: a target with {keys} finds it from every side"
    return ""
