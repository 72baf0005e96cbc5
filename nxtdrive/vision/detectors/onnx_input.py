"""The input of a model for a frame: in its size, its order of colours and its range of values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.onnx_file import OnnxFile, Tensor
from nxtdrive.vision.detectors.onnx_runtimes import Arrays

LARGEST = 2048
"""Pixels; a model that takes larger images is too slow for a camera."""

GRAY = 114
"""Padding around a frame of another shape than the model's input, as in YOLOX's and Ultralytics' training."""

IMAGENET_MEAN, IMAGENET_SD = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
COLORS, NORMALISATIONS = ("bgr", "rgb"), ("none", "unit", "imagenet")


@dataclass(frozen=True, slots=True)
class ImageInput:
    """The input that takes the image.

    Attributes:
        tensor: As the file describes it.
        channels_first: Whether colours come before rows.
        width: Pixels; None where it gets frames as they are.
        height: The same.
        sizes: Another input, which takes the size of the frame.
    """

    tensor: Tensor
    channels_first: bool
    width: int | None
    height: int | None
    sizes: Tensor | None

    def size_for(self, image: Image) -> tuple[int, int]:
        """Return width and height of the model's input for a frame."""
        return self.width or image.shape[1], self.height or image.shape[0]

    def arrays(self, image: Image, colors: str, normalisation: str) -> Arrays:
        """Return all inputs for an image of the model's size; the size of the frame counts as one pixel."""
        values: NDArray[Any] = (image[:, :, ::-1] if colors == "rgb" else image).astype(np.float32)
        if normalisation != "none":
            values = values / 255
        if normalisation == "imagenet":
            values = (values - IMAGENET_MEAN) / IMAGENET_SD
        arranged = values.transpose(2, 0, 1) if self.channels_first else values
        batched = arranged[None] if len(self.tensor.shape or ()) == 4 else arranged
        given = {self.tensor.name: np.ascontiguousarray(batched, self.tensor.dtype)}
        return given if self.sizes is None else given | {self.sizes.name: np.ones((1, 2), self.sizes.dtype)}


def image_input(file: OnnxFile, open_size: int) -> ImageInput:
    """Return the input of a model that takes the image.

    Args:
        file: The model's.
        open_size: Width and height to use where the file leaves them open.

    Raises:
        ConfigError: It has none, or others that are not known.
    """
    by_rank = {rank: [one for one in file.inputs if len(one.shape or ()) == rank] for rank in (2, 3, 4)}
    images, sizes = by_rank[3] + by_rank[4], by_rank[2]
    if len(images) == 1 and len(sizes) <= 1 and len(file.inputs) == len(images) + len(sizes):
        tensor = images[0]
        *batch, first, second, third = tensor.shape or ()
        channels_first = first == 3 or (first is None and third != 3)
        width, height = (third, second) if channels_first else (second, first)
        usable = tensor.dtype in ("float32", "float16", "uint8") and batch in ([], [1], [None])
        colors = first if channels_first else third
        declared = all(one.dtype and one.shape is not None and one.shape[1] in (2, None) for one in sizes)
        if usable and declared and colors in (3, None) and max(width or 1, height or 1) <= LARGEST:
            if batch:
                width, height = width or open_size, height or open_size
            return ImageInput(tensor, channels_first, width, height, sizes[0] if sizes else None)
    inputs = ", ".join(f"{one.name} {one.dtype} {one.shape}" for one in file.inputs[:10])
    remedy = f"Export it with one image as input, 1x3 x height x width of at most {LARGEST} pixels each way."
    raise ConfigError(f"{file.path} takes something other than one image: {inputs}.", remedy=remedy)


def fitted(image: Image, size: tuple[int, int], *, stretched: bool) -> tuple[Image, NDArray[Any]]:
    """Return an image of a size, and by how much it was scaled across and down."""
    width, height = size
    scale = np.array([width / image.shape[1], height / image.shape[0]])
    if not stretched:
        scale[:] = scale.min()
    inner = max(1, round(image.shape[1] * scale[0])), max(1, round(image.shape[0] * scale[1]))
    interpolation = cv2.INTER_AREA if scale.max() < 1 else cv2.INTER_LINEAR
    small = np.asarray(
        image if inner == image.shape[1::-1] else cv2.resize(image, inner, interpolation=interpolation), np.uint8
    )
    if inner == size:
        return small, scale
    framed = np.full((height, width, 3), GRAY, np.uint8)
    framed[: inner[1], : inner[0]] = small
    return framed, scale
