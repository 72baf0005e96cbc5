"""docs/web-protocol.md names every message, and its example drives the robot."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path
from typing import get_args

import pytest

from nxtdrive.tools.web.messages import VERSION, Message, schema

ROOT = Path(__file__).parents[3]
DOCUMENT = (ROOT / "docs" / "web-protocol.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("message", get_args(Message), ids=lambda each: each.__name__)
def test_every_message_and_key_is_explained(message):
    fields = dict(message.model_fields)
    (name,) = get_args(fields.pop("type").annotation)
    (row,) = re.findall(rf"^\| `{name}` \|.*$", DOCUMENT, flags=re.MULTILINE)
    assert all(f"`{key}`" in row for key in fields)


def test_the_page_names_the_version_and_the_schema_has_every_message():
    assert f"version {VERSION}" in DOCUMENT
    assert len(schema()["oneOf"]) == len(get_args(Message))


def test_the_example_is_the_documents():
    (block,) = re.findall(r"```python\n(.*?)```", DOCUMENT, flags=re.DOTALL)
    assert (ROOT / "examples" / "web-client" / "drive.py").read_text(encoding="utf-8").endswith(block)


@pytest.mark.slow
def test_the_example_drives_the_robot(started):
    server = started("web", "--port", "0")
    (port,) = re.findall(r":(\d+)/", server.stdout.readline())
    text = (ROOT / "examples" / "web-client" / "drive.py").read_text(encoding="utf-8").replace("7080", port)
    began = time.monotonic()
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "I am page 1\n"
    assert time.monotonic() - began >= 2.0
    server.terminate()
    assert server.communicate(timeout=60)[0] == "ended; motors off\n"
    assert server.returncode == 0
