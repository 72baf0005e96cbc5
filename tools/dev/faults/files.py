"""Campaign: damaged and odd files of every kind that nxtdrive reads.

A trial writes one file and has it read by the command or function that a user would have read it. A cascade is read by
a process of its own, as always; the other kinds in this one, with a limit on memory and warnings as errors.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from random import Random

import cv2
import numpy as np

from behaviors.journal import RecordKind
from behaviors.mission import BUILT_IN
from firmware_protocol.errors import AddressError, CameraError, ConfigError, LocalProtocolError
from nxtdrive.cli.main import main
from nxtdrive.cli.templates.mission import template
from nxtdrive.mission.files import PICTURES
from nxtdrive.simulated.scenario import generate_scenario
from sim_backend.bundled import WORLDS
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.simulation import Simulation

from ...conformance.recording import load as load_recording
from ...conformance.replay import replay
from ...sweep.causes import ChoiceEvaluation, FailureCause
from ...sweep.result_file import read_results
from ...sweep.summary import aggregate
from ...sweep.task import Task, evaluate, failed, run_episode
from .campaign import Campaign, Tally, Violation
from .mutation import mutated

LONGEST_S = 30.0
"""Hundreds of times what any trial takes; processor time, so that a busy machine does not matter."""
MAX_MEMORY = 6_000_000_000
"""Address space while files are read, bytes."""
REFUSALS = (ConfigError, CameraError, AddressError, LocalProtocolError)
NET = ("nested too deeply. Simplify it", "not enough memory", "standard output or a file cannot be used")
"""Messages of `nxtdrive.cli.main` for errors that the readers of files should have refused."""

Read = Callable[[Path, Random], str]
"""Reads the file; returns the outcome, or raises one of `REFUSALS`."""


def run_command(*words: str, also: tuple[int, ...] = ()) -> str:
    """Run a command line that must accept the file or refuse it with exit code 2."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as left:
            code = int(left.code or 0)
    said = err.getvalue()
    if "Traceback" in said or any(phrase in said for phrase in NET):
        raise AssertionError(f"said: {said[-300:]}")
    if code == 2:
        if not said.strip():
            raise AssertionError("refused without a word")
        return "refused"
    if code not in (0, *also):
        raise AssertionError(f"exit code {code}: {said[-300:]}")
    return "accepted"


def _mission(path: Path, _random: Random) -> str:
    return run_command("mission", "show", str(path))


def _world(path: Path, _random: Random) -> str:
    simulation = Simulation(path)
    simulation.advance(200)
    simulation.webcam.frame()
    return "accepted"


def _faults(path: Path, _random: Random) -> str:
    from sim_backend.faults_file import load_faults

    load_faults(path)
    return "accepted"


def _journal(path: Path, random: Random) -> str:
    profile = random.choice(((), ("--profile", "thesis"), ("--profile", "adaptive")))
    return run_command("explain-run", str(path.parent), *profile, *random.choice(((), ("--json",))))


def _trace(path: Path, random: Random) -> str:
    if random.random() < 0.5:
        return run_command("trace", "show", str(path), random.choice(("--full", "--json")))
    return run_command("info", "--nxt", f"replay://{path}", also=(4, 5))


def _results(path: Path, _random: Random) -> str:
    from rich.console import Console

    from ...sweep.tables import print_tables

    results = read_results(path)
    print_tables(results, Console(file=io.StringIO(), width=80))
    aggregate(results, 1.0)
    return "accepted"


def _picture(path: Path, random: Random) -> str:
    from nxtdrive.vision.detectors import make_detector
    from sim_backend.camera.textures import TextureLibrary

    if random.random() < 0.3:
        return run_command("detect", "try", str(path), "--color", "red", "--out", str(path.with_name("out.png")))
    TextureLibrary()[str(path)]
    make_detector({"detector": "picture", "pictures": [str(path)]})
    return "accepted"


def _cascade(path: Path, _random: Random) -> str:
    from nxtdrive.vision.detectors import make_detector

    make_detector({"detector": "haar", "cascade": str(path)})
    return "accepted"


def _recording(path: Path, random: Random) -> str:
    firmware = random.choice(FIRMWARES)
    for name, scenario in load_recording(path, firmware).items():
        for difference in replay(name, scenario.steps, firmware).differences:
            if difference.exception:
                raise AssertionError(f"{name}, step {difference.step}: {difference.text}")
    return "accepted"


def _upload(path: Path, random: Random) -> str:
    name = _text(random, "follow-line.rxe")
    return run_command("files", "put", str(path), "--as", name.replace("\0", ""), "--nxt", "sim://open", also=(5,))


def _address(_path: Path, random: Random) -> str:
    from nxtdrive.transports import open_transport, transport_class
    from nxtdrive.transports.address import Address

    good = ("sim://open?seed=3&latency_ms=5", "sim://arena", "replay://x.nxttrace", "record://x?nxt=sim://open")
    others = (
        "usb://0016530A1B2C",
        "bt://00:16:53:0A:1B:2C",
        "serial:///dev/rfcomm0",
        "tcp://host:8081",
        "nxt-server://h:1",
    )
    address = Address.parse(_text(random, random.choice(good + others)))
    if address.scheme == "sim":
        open_transport(str(address)).close()
    else:
        transport_class(address.scheme)
    return "accepted"


def _name(_path: Path, random: Random) -> str:
    from nxtdrive.brick import open_brick

    with open_brick("sim://open") as brick:
        brick.files.exists(_text(random, "follow-line.rxe"))
    return "accepted"


def _text(random: Random, good: str) -> str:
    return mutated(good.encode(), random).decode(errors="replace") if random.random() < 0.9 else good


FAULTS = b"""drop_requests = [3, 7]
drop_replies = { every = 10, first = 4 }
corrupt_replies = [12]
delay_replies_ms = { 3 = 1500, 8 = 40 }
silent_ms = [[2000, 2500]]
unplugged_ms = [[4000, 6000]]
"""
TRACE = b"""{"nxttrace": 1, "address": "usb://0016530A1B2C", "max_telegram": 64, "command": ["info"]}
{"t": 0.0, "to": "0188"}
{"t": 0.0021, "from": "0288007c011d01"}
{"t": 0.01, "to": "019b"}
{"t": 0.02, "from": "029b004e585400000000000000000000000000001653010203000000000024d80100"}
{"t": 3.2, "error": "LinkLost", "text": "the cable to usb://0016530A1B2C is gone."}
{"t": 3.3, "to": "000b", "error": "LinkLost", "text": "usb://0016530A1B2C is closed."}
{"t": 4.0, "reopened": true}
{"t": 4.1, "to": "000b"}
{"t": 4.2, "from": "020b004c1d"}
"""
RECORDING = b"""{"scenario": "a", "request": "000b", "reply": "020b001f40", "mask": "ffffff0000"}
{"scenario": "a", "request": "000400640100000000000000", "reply": "020400"}
{"scenario": "b", "control": "!tick 10", "reply": "ok t=10"}
{"scenario": "b", "control": "!trace 20 5", "reply": ""}
{"scenario": "b", "control": "!mkfiles 3", "reply": "ok"}
{"scenario": "b", "control": "!i2c 1 attach 02", "reply": "ok"}
{"scenario": "b", "request": "01872a2e2a00000000000000000000000000000000", "reply": "028700", "step": 3}
"""


@cache
def _run_folder() -> dict[str, bytes]:
    """Return the files of a run with decisions."""
    from behaviors.mission import load_mission

    _, recorder = run_episode(generate_scenario("block_transient", 100), "adaptive", "geometric")
    lines = [record.to_json() for record in recorder.records if record.kind not in (RecordKind.LOOK, RecordKind.STEP)]
    mission = load_mission(BUILT_IN, [PICTURES])
    summary = {"ending": "achieved", "achieved": True, "targets": []}
    return {
        "journal.jsonl": ("\n".join(lines) + "\n").encode(),
        "mission.json": mission.model_dump_json(indent=2).encode(),
        "summary.json": json.dumps(summary).encode(),
    }


@cache
def _result_lines() -> bytes:
    reached = evaluate(Task(0, "open", 100, "oracle", "geometric"))
    results = [
        reached,
        reached.model_copy(
            update={"agent": "thesis", "choices": [ChoiceEvaluation(cause, "wait", 1.5) for cause in FailureCause]}
        ),
        failed(Task(2, "far", 1, "thesis", "camera"), OSError()),
    ]
    return "".join(result.to_json() + "\n" for result in results).encode()


@cache
def _image(suffix: str) -> bytes:
    pixels = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    return cv2.imencode(suffix, pixels)[1].tobytes()


@cache
def _frontal() -> bytes:
    return (Path(cv2.__file__).parent / "data" / "haarcascade_frontalface_alt2.xml").read_bytes()


KINDS: dict[str, tuple[int, str, tuple[Callable[[], bytes], ...], Read]] = {
    "mission": (15, "x.toml", (BUILT_IN.read_bytes, lambda: template().encode()), _mission),
    "world": (12, "x.toml", tuple(path.read_bytes for path in sorted(WORLDS.glob("*.toml"))), _world),
    "faults": (10, "x.toml", (lambda: FAULTS,), _faults),
    "journal": (12, "journal.jsonl", (lambda: _run_folder()["journal.jsonl"],), _journal),
    "mission.json": (4, "mission.json", (lambda: _run_folder()["mission.json"],), _journal),
    "summary.json": (1, "summary.json", (lambda: _run_folder()["summary.json"],), _journal),
    "trace": (12, "x.nxttrace", (lambda: TRACE,), _trace),
    "sweep": (6, "x.jsonl", (_result_lines,), _results),
    "png": (4, "x.png", (lambda: _image(".png"),), _picture),
    "jpg": (4, "x.jpg", (lambda: _image(".jpg"),), _picture),
    "bmp": (2, "x.bmp", (lambda: _image(".bmp"),), _picture),
    "cascade": (1, "x.xml", (_frontal,), _cascade),
    "recording": (8, "x.jsonl", (lambda: RECORDING,), _recording),
    "upload": (2, "x.rxe", (lambda: bytes(range(256)),), _upload),
    "address": (5, "none", (lambda: b"",), _address),
    "name on the brick": (2, "none", (lambda: b"",), _name),
}
"""Kind -> its share of the trials in per cent, the file's name, good contents, and how it is read."""


def _run(seed: int, numbers: range) -> Tally:
    tally = Tally()
    names = list(KINDS)
    weights = [KINDS[name][0] for name in names]
    with tempfile.TemporaryDirectory() as folder, _limited_memory(), warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in numbers:
            random = Random(f"{seed} {number}")  # noqa: S311 - not for secrets
            kind = random.choices(names, weights)[0]
            with tempfile.TemporaryDirectory(dir=folder) as place:
                attempt(tally, number, kind, Path(place), random)
    return tally


def attempt(tally: Tally, number: int, kind: str, place: Path, random: Random) -> None:
    """Make one trial."""
    _, name, goods, read = KINDS[kind]
    if read is _journal:
        for other, content in _run_folder().items():
            (place / other).write_bytes(content)
    path = place / name
    path.write_bytes(mutated(random.choice(goods)(), random))
    begun_s = time.process_time()
    try:
        outcome = read(path, random)
    except REFUSALS as error:
        outcome = "refused" if str(error).strip() else "refused without a word"
    except Exception as error:  # noqa: BLE001 - this is what must not happen
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {str(error)[:300]} at {Path(where.filename).name}:{where.lineno}"
        tally.violations.append(Violation(number, f"{kind}: {text}; the file begins {path.read_bytes()[:120]!r}"))
        return
    if (took_s := time.process_time() - begun_s) > LONGEST_S:
        tally.violations.append(Violation(number, f"{kind}: it took {took_s:.0f} s"))
    tally.outcomes[f"{kind}: {outcome}"] += 1


@contextlib.contextmanager
def _limited_memory() -> Iterator[None]:
    """Limit this process's address space for a block, where the system can."""
    if sys.platform == "win32":
        yield
        return
    import resource

    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


CAMPAIGN = Campaign(
    guarantee="A damaged file of any kind that nxtdrive reads is accepted, or refused with a sentence and exit code 2.",
    unit="files",
    count=10_000,
    batch=50,
    run=_run,
)
