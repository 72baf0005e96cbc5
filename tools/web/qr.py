"""The page's address as a QR code for the terminal."""

from __future__ import annotations

import io

import segno


def qr_code(text: str) -> str:
    """Return a QR code of half-block characters, for light text on a dark background."""
    code = io.StringIO()
    segno.make(text, micro=False).terminal(code, compact=True, border=2)
    return code.getvalue().rstrip("\n")
