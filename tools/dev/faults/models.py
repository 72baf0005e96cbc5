"""Campaign: damaged and odd neural networks.

Each is loaded and run as a target's would be, in a process of its own with a limit on memory: that may crash, as a
runtime does now and then, but it must not print anything except why it refuses the file.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import tempfile
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from random import Random

import numpy as np
import onnx

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors.onnx_model import OnnxModel, Options
from nxtdrive.vision.detectors.onnx_runtimes import RUNTIMES
from nxtdrive.vision.detectors.trial import MAX_MEMORY
from nxtdrive.vision.opencv import configure

from ..onnx_models import LAYOUTS, constant_model, outputs_of, red_model, yunet_model
from .campaign import Campaign, Tally, Violation
from .mutation import mutated

LONGEST_S = 30
"""Processor time of one process."""
ACCEPTED, REFUSED, SURPRISED = 0, 3, 4
SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 63, 65, 1000, 10**6, 2**31 - 1, 2**31, 2**40, -1)


@cache
def _goods() -> tuple[bytes, ...]:
    """Return models of all layouts."""
    layouts = {layout: outputs_of(layout) for layout in LAYOUTS}
    constant = [
        constant_model(outputs, whole=("labels",) if "labels" in outputs else (), takes_size=layout == "detr-post")
        for layout, outputs in layouts.items()
    ]
    return (*constant, red_model(), yunet_model(), constant_model(layouts["yolo"], shape=("n", 3, "h", "w")))


def damaged(number: int, seed: int) -> tuple[bytes, Options]:
    """Return the model of a trial, and the options with which it is read."""
    random = Random(f"{seed} {number}")  # noqa: S311 - not for secrets
    content = random.choice(_goods())
    if random.random() < 0.7:
        model = onnx.ModelProto.FromString(content)
        for _ in range(random.choice((1, 1, 2, 4))):
            random.choice(_CHANGES)(model, random)
        content = model.SerializeToString()
    if random.random() < 0.4:
        content = mutated(content, random)
    return content, Options(runtime=random.choice(RUNTIMES), size=random.choice((32, 64, 416)))


def _dimension(model: onnx.ModelProto, random: Random) -> None:
    graph = model.graph
    value = random.choice([*graph.input, *graph.output])
    if dimensions := value.type.tensor_type.shape.dim:
        random.choice(dimensions).dim_value = random.choice(SIZES)


def _type(model: onnx.ModelProto, random: Random) -> None:
    value = random.choice([*model.graph.input, *model.graph.output])
    value.type.tensor_type.elem_type = random.randint(0, 24)


def _weight(model: onnx.ModelProto, random: Random) -> None:
    weight = random.choice(model.graph.initializer)
    how = random.randrange(4)
    if how == 0 and weight.dims:
        weight.dims[random.randrange(len(weight.dims))] = random.choice(SIZES)
    elif how == 1:
        weight.raw_data = weight.raw_data[: random.randint(0, len(weight.raw_data))]
    elif how == 2:
        weight.data_type = random.randint(0, 24)
    else:
        values = np.frombuffer(weight.raw_data[: len(weight.raw_data) // 4 * 4], np.float32).copy()
        if values.size:
            values[random.randrange(values.size)] = random.choice((np.nan, np.inf, -np.inf, 1e38, -1e38, 0, -1))
            weight.raw_data = values.tobytes()


def _operator(model: onnx.ModelProto, random: Random) -> None:
    operators = ("Reshape", "Transpose", "Tile", "Expand", "Gather", "Loop", "If", "Conv", "Resize", "Nonsense")
    random.choice(model.graph.node).op_type = random.choice(operators)


def _wire(model: onnx.ModelProto, random: Random) -> None:
    """Connect something else, perhaps in a circle."""
    node, other = random.choice(model.graph.node), random.choice(model.graph.node)
    if node.input and other.output:
        others = *other.output, *other.input, "", "nothing at all"
        node.input[random.randrange(len(node.input))] = random.choice(others)


def _part(model: onnx.ModelProto, random: Random) -> None:
    """Leave something out, or repeat it."""
    graph = model.graph
    parts = random.choice((graph.node, graph.initializer, graph.input, graph.output))
    if parts and random.random() < 0.5:
        del parts[random.randrange(len(parts))]
    elif parts:
        parts.append(random.choice(parts))


def _metadata(model: onnx.ModelProto, random: Random) -> None:
    odd = ("{" * 3000, "{0: 'a', 99999999: 'b'}", "[" + "1," * 50_000, "x" * 100_000, "\0\ud7ff", '{"a": {"b": 1}}')
    onnx.helper.set_model_props(model, {"names": random.choice(odd)})


_CHANGES: tuple[Callable[[onnx.ModelProto, Random], None], ...] = (
    *(_dimension, _dimension, _type, _weight, _weight, _weight),
    *(_operator, _wire, _wire, _part, _part, _metadata),
)


def read_apart(path: Path, options: Options) -> tuple[str, str]:
    """Load and run a model in a forked process; return the outcome and its output."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    child = os.fork()
    if child == 0:
        receiver.close()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_S, LONGEST_S))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        code, said = ACCEPTED, ""
        try:
            OnnxModel(path, options).places(np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8))
        except ConfigError as error:
            code, said = REFUSED, str(error)
        except BaseException as error:  # noqa: BLE001 - this is what must not happen
            code, said = SURPRISED, f"{type(error).__name__}: {error}"
        sender.send(said[:2000])
        os._exit(code)
    sender.close()
    try:
        said = str(receiver.recv())
    except EOFError:
        said = ""
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        number = signal.Signals(os.WTERMSIG(status))
        return ("took too long" if number in (signal.SIGXCPU, signal.SIGKILL) else "crashed its process"), number.name
    names = {ACCEPTED: "accepted", REFUSED: "refused", SURPRISED: "surprised"}
    return names.get(os.WEXITSTATUS(status), "crashed its process"), said


def _run(seed: int, numbers: range) -> Tally:
    configure()
    import_module("onnxruntime")  # once, before processes are forked
    tally = Tally()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        for number in numbers:
            content, options = damaged(number, seed)
            path.write_bytes(content)
            outcome, said = read_apart(path, options)
            if outcome in ("surprised", "took too long") or (outcome == "refused" and str(path) not in said):
                tally.violations.append(Violation(number, f"{options.runtime}: {outcome}: {said}"))
            tally.outcomes[f"{options.runtime}: {outcome}"] += 1
    return tally


CAMPAIGN = Campaign(
    guarantee="A damaged neural network is refused with the reason; at most the process that tries it fails.",
    unit="models",
    count=10_000,
    batch=250,
    run=_run,
)
