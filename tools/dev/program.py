"""The command line of the programs in this folder: what they do is their module's docstring."""

from __future__ import annotations

from argparse import ArgumentParser, RawDescriptionHelpFormatter


def parser(text: str | None) -> ArgumentParser:
    """Return a parser whose help begins with this text."""
    return ArgumentParser(description=text, formatter_class=RawDescriptionHelpFormatter)
