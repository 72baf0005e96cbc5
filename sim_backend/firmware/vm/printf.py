"""Numbers by patterns of C's printf. Source: docs/firmware.md section 8.6."""

from __future__ import annotations

import math
import re
import struct

from sim_backend.firmware.cint import s8, s16, s32
from sim_backend.firmware.vm.memory import OutOfMemory
from sim_backend.firmware.vm.numbers import Number
from sim_backend.firmware.vm.pool_layout import POOL_SIZE

_CONVERSION = re.compile(
    r"%(?P<flags>[+\-# 0]*)(?P<width>\d*)(?:\.(?P<precision>\d*))?(?P<length>[hl]*)(?P<kind>[diuxXoceEfFgG])|%%"
)
_FLOATS, _UNSIGNED = "eEfFgG", {"u": "d", "x": "x", "X": "X", "o": "o"}
_U32 = 0xFFFF_FFFF
_MASKS, _SIGNED = {"h": 0xFFFF, "hh": 0xFF}, {"h": s16, "hh": s8}


def printed(pattern: str, value: Number) -> str:
    """Return a pattern with a number in place of its first conversion; for a wrong type, its bits are used.

    Raises:
        OutOfMemory: The number would not fit into the pool.
    """
    done = False

    def convert(found: re.Match[str]) -> str:
        nonlocal done
        if found[0] == "%%":
            return "%"
        if done:
            return found[0]
        done = True
        if max(int(found["width"] or 0), int(found["precision"] or 0)) > POOL_SIZE:
            raise OutOfMemory
        return _float(found, value) if found["kind"] in _FLOATS else _integer(found, value)

    return _CONVERSION.sub(convert, pattern)


def _float(found: re.Match[str], value: Number) -> str:
    if not isinstance(value, float):
        value = struct.unpack("<d", struct.pack("<q", int(value) & _U32))[0]
    flags = found["flags"]
    sign = "-" if math.copysign(1, value) < 0 else _plus(flags)
    if not math.isfinite(value):
        name = "nan" if math.isnan(value) else "inf"
        return _padded(found, sign, name.upper() if found["kind"].isupper() else name, zeros=False)
    precision = "" if found["precision"] is None else f".{found['precision'] or 0}"
    digits = f"%{'#' if '#' in flags else ''}{precision}{found['kind']}" % abs(value)
    return _padded(found, sign, digits, zeros=True)


def _integer(found: re.Match[str], value: Number) -> str:
    flags, kind, precision = found["flags"], found["kind"], found["precision"]
    if isinstance(value, float):
        value = int.from_bytes(struct.pack("<d", value)[:4], "little", signed=True)
    if kind == "c":
        return _padded(found, "", chr(int(value) & 0xFF), zeros=False)
    if kind in _UNSIGNED:
        value, sign = int(value) & _MASKS.get(found["length"], _U32), ""
        digits = format(value, _UNSIGNED[kind])
    else:
        value = _SIGNED.get(found["length"], s32)(int(value))
        sign, digits = "-" if value < 0 else _plus(flags), str(abs(value))
    if precision is not None:
        digits = digits.zfill(int(precision or 0)) if value or int(precision or 0) else ""
    if "#" in flags and kind in "xXo" and value:
        sign, digits = ("0" + kind, digits) if kind != "o" else ("", "0" + digits.lstrip("0").zfill(len(digits) - 1))
    return _padded(found, sign, digits, zeros=precision is None)


def _plus(flags: str) -> str:
    return "+" if "+" in flags else " " if " " in flags else ""


def _padded(found: re.Match[str], sign: str, digits: str, *, zeros: bool) -> str:
    flags, width = found["flags"], int(found["width"] or 0)
    if "-" in flags:
        return (sign + digits).ljust(width)
    return sign + digits.zfill(width - len(sign)) if zeros and "0" in flags else (sign + digits).rjust(width)
