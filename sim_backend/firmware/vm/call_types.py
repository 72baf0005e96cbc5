"""Types as which the firmware reads the arguments of system calls, whatever the program declares.

A letter for each argument, as in `struct`; a dot stands for an array or cluster. Source: docs/firmware.md section 8.4.
"""

from __future__ import annotations

from collections.abc import Mapping

from sim_backend.firmware.vm.rxe import Type

LETTERS: Mapping[str, Type] = {
    "B": Type.UBYTE,
    "b": Type.SBYTE,
    "H": Type.UWORD,
    "h": Type.SWORD,
    "I": Type.ULONG,
    "i": Type.SLONG,
}

CALL_TYPES: Mapping[int, str] = {
    **dict.fromkeys((0, 1, 2, 3), "HB.I"),
    4: "HB.H",
    5: "HB",
    6: "HBB.",
    7: "H..",
    8: "H.",
    9: "b.BB",
    10: "bHHBB",
    11: "BB",
    12: "BBB",
    13: "b..I",
    14: "b.I",
    15: "b..I",
    16: "b.BI",
    17: "b..I",
    18: "b...I",
    19: "bB",
    20: "bBBBB",
    **dict.fromkeys((21, 22, 37, 38), "bB.B"),
    **dict.fromkeys((23, 39), "bBB"),
    24: "h",
    25: "I",
    26: "bB.",
    27: "bBB.",
    28: "bB",
    29: "bB.",
    31: "I",
    32: "b.HH.",
    33: "b.H.",
    34: "bBh...B",
    35: "BB",
    36: "BB.B",
    40: "BB",
    41: "BBBB",
    42: "B.H",
    43: "B.HH",
    44: "b.",
    45: ".II",
    46: "bI",
    47: "b..",
}
"""Types of the arguments of each of LEGO's calls, by its number."""

ENHANCED_CALL_TYPES: Mapping[int, str] = {
    35: "HB",
    36: "HB.B",
    **dict.fromkeys((37, 38), "b."),
    39: "BB",
    78: "bIHH.",
    79: "bIH.",
    80: "bBBBBBB",
    82: "HB..I",
    **dict.fromkeys((83, 84, 85, 86, 87), "HB.I"),
    88: "BBBH",
    90: "HBBi",
    91: "HBI",
    96: "bBHH",
    97: "bBBB.",
    98: "HBI",
    99: "IB",
}
"""The same for calls that firmware 1.32 has added or changed."""
