"""Integer arithmetic as the firmware's C does it: fixed widths, division towards zero."""

from __future__ import annotations

import struct


def divide(dividend: int, divisor: int) -> int:
    """Return the quotient rounded towards zero; a division by zero gives zero, as ARM's run-time library does."""
    if not divisor:
        return 0
    quotient = abs(dividend) // abs(divisor)
    return quotient if (dividend < 0) == (divisor < 0) else -quotient


def clamp(value: int, limit: int) -> int:
    """`value` limited to -limit..limit."""
    return limit if value > limit else -limit if value < -limit else value


def fit(code: str, value: int) -> int:
    """Return the bits of `value` that a variable holds; `code` is the `struct` format of the variable's type."""
    bits = 8 * struct.calcsize("<" + code)
    value &= (1 << bits) - 1
    return value - (1 << bits) if code.islower() and value >> (bits - 1) else value


def s8(value: int) -> int:
    """Return the low 8 bits, signed."""
    return (value + 0x80 & 0xFF) - 0x80


def s16(value: int) -> int:
    """Return the low 16 bits, signed."""
    return (value + 0x8000 & 0xFFFF) - 0x8000


def s32(value: int) -> int:
    """Return the low 32 bits, signed."""
    return (value + 0x8000_0000 & 0xFFFF_FFFF) - 0x8000_0000
