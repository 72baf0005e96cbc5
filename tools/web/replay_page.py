"""A run's replay as one HTML file that opens from disk, without a server and without a network."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from importlib import resources
from pathlib import Path

from input_files.plain import InputFileError, read_bytes
from nxtdrive.recording.camera_index import MAX_FRAME_BYTES, RecordedFrame, RecordedFrames
from nxtdrive.recording.run_reader import PastRun
from nxtdrive.vision.camera import frame_number

from .replay_data import replay_data

STATIC = Path(str(resources.files(__package__))) / "static"
MODULE = "nxtdrive/"
"""Begins the names of modules in the page; relative ones lead nowhere, since a module in a data URL has no folder."""
JPEG = b"\xff\xd8\xff"
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data:; connect-src 'none'"
)
"""The page fetches nothing."""


def replay_page(name: str, run: PastRun, camera: RecordedFrames | None) -> str:
    """Return the page: the replay's own modules and styles, and the run with its frames, in one text.

    Args:
        name: Of the run folder.
        run: The run.
        camera: Its frames; those that cannot be read are left out.
    """
    sources: dict[str, str] = {}
    if camera:
        sources = {each.file: source for each in camera.frames if (source := _data_url(camera.folder / each.file))}
        camera = replace(camera, frames=tuple(each for each in camera.frames if each.file in sources))
    data = json.dumps(replay_data(name, run, camera, lambda frame: sources[frame.file]))
    modules = {f"{MODULE}{path.name}": _module(path) for path in sorted(STATIC.glob("*.js"))}
    scripts = (
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<script type="application/json" id="run">{_inside(data)}</script>\n'
        f'<script type="importmap">{_inside(json.dumps({"imports": modules}))}</script>\n'
        f'<script type="module">import "{MODULE}replay.js";</script>'
    )
    page = (STATIC / "replay.html").read_text(encoding="utf-8")
    page = re.sub(r"<nav>.*?</nav>", "", page)
    page = re.sub(
        r'<link rel="stylesheet" href="(\w+\.css)">',
        lambda link: f"<style>\n{(STATIC / link[1]).read_text(encoding='utf-8')}</style>",
        page,
    )
    return page.replace('<script type="module" src="replay.js"></script>', scripts)


def thinned(camera: RecordedFrames, fps: float) -> RecordedFrames:
    """Leave out frames: of those in each slot of ``1 / fps`` seconds the first stays."""
    if fps >= camera.header.fps:
        return camera
    slots: dict[int, RecordedFrame] = {}
    for frame in camera.frames:
        slots.setdefault(frame_number(frame.t, fps), frame)
    return replace(camera, frames=tuple(slots.values()))


def _module(path: Path) -> str:
    """Return a module as a data URL, its imports renamed."""
    code = re.sub(r'(from |import )"\./', rf'\1"{MODULE}', path.read_text(encoding="utf-8"))
    return f"data:text/javascript;base64,{_base64(code.encode())}"


def _data_url(path: Path) -> str:
    """Return a frame as a data URL, or an empty string if it cannot be read."""
    try:
        content = read_bytes(path, MAX_FRAME_BYTES)
    except InputFileError:
        return ""
    return f"data:image/jpeg;base64,{_base64(content)}" if content.startswith(JPEG) else ""


def _inside(text: str) -> str:
    """Return JSON for a script element, which none of its strings can end."""
    return text.replace("<", "\\u003c")


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
