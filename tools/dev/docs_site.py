"""The documentation site's pages that are not in docs/: README, changelog, contributing, and each example's README.

A hook of mkdocs (mkdocs.yml). Links between Markdown files, which are written for the repository, become links between
pages; a link to any other file of the repository becomes the file's path in it.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")
CELL = re.compile(r"<td.*?</td>", re.DOTALL)
SLASH = re.compile(r"(?:(?<=\w)/(?=\w)|::)(?![^<]*>)")
CODE = re.compile(r"<code>(.*?)</code>", re.DOTALL)
DRAWING = re.compile(r"<pre(?=(?:(?!</pre>).)*[─│▼├])", re.DOTALL)
HYPHENATED = re.compile(r"(?<![\w&;-])\w+(?:-\w+)+(?![^<]*>)")
OPTION = re.compile(r"(?<![\w&;-])--?[A-Za-z][\w-]*(?![^<]*>)")
ELSEWHERE = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}


def pages() -> dict[str, str]:
    """Return the pages that are made of files outside docs/: path in the repository -> page."""
    examples = sorted((ROOT / "examples").glob("*/README.md"))
    return {
        **ELSEWHERE,
        **{f"examples/{each.parent.name}/README.md": f"examples/{each.parent.name}.md" for each in examples},
    }


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages."""
    from mkdocs.structure.files import File

    for source, page in pages().items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:  # noqa: ANN401 - mkdocs'
    """Point links to pages."""
    return site_links(markdown, page.file.src_uri)


def on_page_content(html: str, **_: Any) -> str:  # noqa: ANN401 - mkdocs'
    """Leave out what introduces a program in a docstring, which its frame does on the page; mark options, drawings."""
    return marked_drawings(whole_options(breakable_paths(html.replace("<p>::</p>\n", ""))))


def marked_drawings(html: str) -> str:
    """Mark blocks of text that are drawings, which site.css does not wrap."""
    return DRAWING.sub('<pre class="drawing"', html)


def breakable_paths(html: str) -> str:
    """Let paths in tables break after a slash, and names of tests after an underscore; other names stay whole."""

    def mark(code: re.Match[str]) -> str:
        path, colons, test = _whole(HYPHENATED, SLASH.sub(r"\g<0><wbr>", code.group())).partition("::")
        return path + colons + (test.replace("_", "_<wbr>") if colons else "")

    return CELL.sub(lambda cell: CODE.sub(mark, cell.group()), html)


def whole_options(html: str) -> str:
    """Mark the options in code, such as ``--out``, which site.css keeps on one line: browsers break after hyphens."""
    return CODE.sub(lambda code: _whole(OPTION, code.group()), html)


def _whole(names: re.Pattern[str], html: str) -> str:
    """Keep what matches on one line."""
    return names.sub(r'<span class="whole">\g<0></span>', html)


def site_links(markdown: str, page: str) -> str:
    """Return a page with the links of the site.

    Args:
        markdown: With the links of the repository.
        page: Its path on the site, such as ``examples/lesson.md``.
    """
    made = pages()
    source = next((path for path, each in made.items() if each == page), f"docs/{page}")

    def point(match: re.Match[str]) -> str:
        picture, text, target, anchor = match.groups(default="")
        if not target or ":" in target:
            return match.group()
        path = os.path.normpath(PurePosixPath(source).parent / target)
        readme = f"{path}/README.md"
        there = made.get(path) or made.get(readme)
        if there is None and path.startswith("docs/"):
            there = path.removeprefix("docs/")
        if there is None or not ((ROOT / "docs" / there).is_file() or there in made.values()):
            return text if picture else _with_path(text, path)
        if text.endswith(".md"):  # the name of a file says little on a page
            text = _title(path if path in made else f"docs/{there}")
        link = f"[{text}]({os.path.relpath(there, PurePosixPath(page).parent)}{anchor})"
        return f"[!{link}]({link.rpartition('(')[2]}" if picture else link  # a picture opens in its full size

    return LINK.sub(point, markdown)


def _with_path(text: str, path: str) -> str:
    """Return a link's text with the path in the repository, or the path alone if the text is the file's name."""
    named = path.endswith(text.strip("`"))
    return f"`{path}`" if named else f"{text} (`{path}`)"


def _title(source: str) -> str:
    """Return the first heading of a Markdown file of the repository."""
    return (ROOT / source).read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
