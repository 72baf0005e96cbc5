from pathlib import Path

from firmware_protocol.catalog import ALL_COMMANDS
from nxtdrive.tools.dev.opcode_table import document

DOCUMENT = Path(__file__).parents[2] / "docs" / "protocol.md"


def test_the_document_is_the_one_made_from_the_declarations():
    assert DOCUMENT.read_text(encoding="utf-8") == document(), (
        "run: python -m tools.dev.opcode_table > docs/protocol.md"
    )


def test_the_document_names_every_command():
    assert all(f"| {command.__name__} " in document() for command in ALL_COMMANDS)
