"""Count lines of code by package: a line counts if it holds a token that is neither comment nor docstring.

Imports count; docstrings, comments and blank lines do not.

::

    python -m tools.dev.count_lines [FOLDER]
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from pathlib import Path

from .program import parser

PACKAGES = ("firmware_protocol", "input_files", "nxtdrive", "behaviors", "sim_backend", "tools", "tests", "examples")

_SILENT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def docstring_lines(tree: ast.AST) -> set[int]:
    """Return the numbers of the lines that hold docstrings, including those of attributes and constants."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        for statement in getattr(node, "body", []) if not isinstance(node, ast.Lambda | ast.IfExp) else []:
            if (
                isinstance(statement, ast.Expr)
                and isinstance(statement.value, ast.Constant)
                and isinstance(statement.value.value, str)
            ):
                lines.update(range(statement.lineno, (statement.end_lineno or statement.lineno) + 1))
    return lines


def code_lines(source: str) -> int:
    """Count the lines of code of one module."""
    docstrings = docstring_lines(ast.parse(source))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _SILENT:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - docstrings)


def main() -> None:
    """Print a table of files and lines by package."""
    arguments = parser(__doc__)
    arguments.add_argument("folder", metavar="FOLDER", nargs="?", type=Path, default=Path(__file__).parents[2])
    root = arguments.parse_args().folder
    totals: Counter[str] = Counter()
    files: Counter[str] = Counter()
    docs: Counter[str] = Counter()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            source = path.read_text(encoding="utf-8")
            name = "tools/dev" if path.is_relative_to(root / "tools" / "dev") else package
            totals[name] += code_lines(source)
            docs[name] += len(docstring_lines(ast.parse(source)))
            files[name] += 1
    print(f"{'package':20}{'files':>7}{'code':>8}{'docstrings':>12}")
    for name in totals:
        print(f"{name:20}{files[name]:7}{totals[name]:8}{docs[name]:12}")
    print(f"{'total':20}{sum(files.values()):7}{sum(totals.values()):8}{sum(docs.values()):12}")


if __name__ == "__main__":
    main()
