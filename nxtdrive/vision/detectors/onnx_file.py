"""Read what an ONNX file says about itself: inputs, outputs and metadata, without a runtime.

Only these few fields of the protocol buffer are read; nodes and weights are skipped. Source of the field numbers:
onnx.proto3 of ONNX 1.20, messages ModelProto, GraphProto, ValueInfoProto, TypeProto and TensorShapeProto.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from firmware_protocol.errors import ConfigError
from input_files.plain import MEGABYTE, InputFileError, read_bytes, refuse_empty

MAX_BYTES = 400 * MEGABYTE
"""The largest detectors that a laptop runs in a second a frame have half of it."""

MAX_FIELDS = 1_000_000
"""Parts of a file that are read at most; a model with a thousand layers has about ten thousand."""

CHECKPOINTS = (".pt", ".pth")
"""Endings of the files in which PyTorch keeps a model's weights."""

TYPES = {1: "float32", 2: "uint8", 3: "int8", 6: "int32", 7: "int64", 9: "bool", 10: "float16", 11: "float64"}
"""Elements of tensors that numpy has, by their number in TensorProto.DataType."""

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5


@dataclass(frozen=True, slots=True)
class Tensor:
    """An input or an output.

    Attributes:
        name: Its name.
        shape: Its dimensions, None where the file leaves one open; None if it says nothing of them.
        dtype: Name of numpy's type of its elements; empty if numpy has none.
    """

    name: str
    shape: tuple[int | None, ...] | None
    dtype: str


@dataclass(frozen=True, slots=True)
class OnnxFile:
    """The description that a file has of itself.

    Attributes:
        path: The file.
        inputs: Without those that have a value in the file.
        outputs: In the file's order.
        metadata: The exporter's entries, and ``producer`` if it is named.
    """

    path: Path
    inputs: tuple[Tensor, ...]
    outputs: tuple[Tensor, ...]
    metadata: dict[str, str]


def read_onnx(path: Path) -> OnnxFile:
    """Read a file's inputs, outputs and metadata.

    Raises:
        ConfigError: It cannot be read, is empty or too large, or is not an ONNX model.
    """
    try:
        content = read_bytes(path, MAX_BYTES)
        refuse_empty(path, len(content))
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    try:
        return _Reader().model(path, content)
    except ValueError as error:
        remedy = "Export or download it again, as a file *.onnx."
        if path.suffix in CHECKPOINTS:
            remedy = f"Export it as ONNX; Ultralytics does so by: yolo export model={path.name} format=onnx"
        raise ConfigError(f"{path} is not an ONNX model ({error}).", remedy=remedy) from None


Part = int | memoryview | bytes


class _Reader:
    """Walks through one protocol buffer; counts its fields, so that a damaged file takes no time either."""

    def __init__(self) -> None:
        self._left = MAX_FIELDS

    def model(self, path: Path, content: bytes) -> OnnxFile:
        graphs, metadata = [], {}
        for number, value in self._fields(memoryview(content)):
            if number == 7:
                graphs.append(_message(value))
            elif number == 2:
                metadata["producer"] = _text(value)
            elif number == 14:
                pair = dict(self._fields(_message(value)))
                metadata[_text(pair.get(1, b""))] = _text(pair.get(2, b""))
        if len(graphs) != 1:
            raise ValueError("it has no graph")
        inputs, outputs, weights = self._graph(graphs[0])
        if not inputs or not outputs:
            raise ValueError("its graph has no inputs or no outputs")
        return OnnxFile(path, tuple(one for one in inputs if one.name not in weights), tuple(outputs), metadata)

    def _graph(self, graph: memoryview) -> tuple[list[Tensor], list[Tensor], set[str]]:
        inputs, outputs, weights = [], [], set()
        for number, value in self._fields(graph):
            if number == 11:
                inputs.append(self._tensor(_message(value)))
            elif number == 12:
                outputs.append(self._tensor(_message(value)))
            elif number == 5:
                weights |= {_text(part) for key, part in self._fields(_message(value)) if key == 8}
        return inputs, outputs, weights

    def _tensor(self, info: memoryview) -> Tensor:
        name, dtype, shape = "", "", None
        for number, value in self._fields(info):
            if number == 1:
                name = _text(value)
            elif number == 2:
                for kind, tensor in self._fields(_message(value)):
                    for key, part in self._fields(_message(tensor)) if kind == 1 else ():
                        if key == 1 and isinstance(part, int):
                            dtype = TYPES.get(part, "")
                        elif key == 2:
                            shape = tuple(self._dimension(_message(one)) for _, one in self._fields(_message(part)))
        return Tensor(name, shape, dtype)

    def _dimension(self, dimension: memoryview) -> int | None:
        sizes = [value for number, value in self._fields(dimension) if number == 1 and isinstance(value, int)]
        return sizes[-1] if sizes and 0 < sizes[-1] < 2**31 else None

    def _fields(self, message: memoryview) -> Iterator[tuple[int, Part]]:
        """Yield number and value of each field of a message."""
        at = 0
        while at < len(message):
            self._left -= 1
            if self._left < 0:
                raise ValueError("it has too many parts")
            tag, at = _varint(message, at)
            number, wire = tag >> 3, tag & 7
            if wire == VARINT:
                value, at = _varint(message, at)
                yield number, value
            elif wire == BYTES:
                length, at = _varint(message, at)
                if at + length > len(message):
                    raise ValueError("it is cut short")
                yield number, message[at : at + length]
                at += length
            elif wire in (FIXED32, FIXED64):
                at += 4 if wire == FIXED32 else 8
            else:
                raise ValueError("it is not a protocol buffer")


def _varint(message: memoryview, at: int) -> tuple[int, int]:
    """Return the number at a place, and the place after it."""
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(message):
            break
        byte = message[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("it is cut short or damaged")


def _message(value: Part) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number stands where a message belongs")  # noqa: TRY004 - the file's mistake
    return memoryview(value)


def _text(value: Part) -> str:
    return bytes(_message(value)).decode("utf-8", "replace")
