"""The documentation site: links of the repository become links between pages, and the build has no warning."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from nxtdrive.tools.dev.docs_site import breakable_paths, marked_drawings, pages, site_links, whole_options

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("page", "written", "shown"),
    [
        ("index.md", "[web](docs/web.md#one-run-in-the-browser)", "[web](web.md#one-run-in-the-browser)"),
        ("index.md", "![run](docs/images/run.png)", "[![run](images/run.png)](images/run.png)"),
        ("index.md", "[lesson](examples/lesson)", "[lesson](examples/lesson.md)"),
        ("index.md", "[licence](examples/x.txt)", "licence (`examples/x.txt`)"),
        ("web.md", "[`hub.py`](../tools/web/hub.py)", "`tools/web/hub.py`"),
        ("web.md", "[hub.py](../tools/web/hub.py)", "`tools/web/hub.py`"),
        ("web.md", "[motion.md](motion.md#waits)", "[Motion: leases, exact moves, stalls](motion.md#waits)"),
        ("index.md", "[docs/web.md](docs/web.md)", "[The page in the browser](web.md)"),
        ("web.md", "[README.md](../README.md)", "[nxtdrive](index.md)"),
        ("index.md", "[pyproject.toml](pyproject.toml)", "`pyproject.toml`"),
        ("web.md", "[home](../README.md)", "[home](index.md)"),
        ("web.md", "[here](#missions), [there](https://semver.org)", "[here](#missions), [there](https://semver.org)"),
        ("examples/lesson.md", "[tests](../../docs/testing-your-robot.md)", "[tests](../testing-your-robot.md)"),
        ("adr/0001-telegrams-declared-once.md", "[all](../protocol.md)", "[all](../protocol.md)"),
    ],
)
def test_links_lead_to_pages(page, written, shown):
    assert site_links(written, page) == shown


def test_options_in_code_stay_on_one_line():
    shown = whole_options('<p>as --out</p><code>run --out a-b -v</code><code><a href="x--y -z">--in-order</a></code>')
    options = [f'<span class="whole">{each}</span>' for each in ("--out", "-v", "--in-order")]
    assert shown == (
        f'<p>as --out</p><code>run {options[0]} a-b {options[1]}</code><code><a href="x--y -z">{options[2]}</a></code>'
    )


def test_paths_in_tables_break_after_a_slash():
    shown = breakable_paths('<code>a/b</code><td><a href="c/d"><code>docs/web.md</code></a> e/f</td>')
    assert shown == '<code>a/b</code><td><a href="c/d"><code>docs/<wbr>web.md</code></a> e/f</td>'


def test_names_with_hyphens_in_tables_stay_on_one_line():
    shown = breakable_paths("<td><code>a/b-c --d-e</code> f-g</td><p><code>h-i</code></p>")
    assert shown == '<td><code>a/<wbr><span class="whole">b-c</span> --d-e</code> f-g</td><p><code>h-i</code></p>'


def test_names_of_tests_in_tables_break_after_an_underscore():
    shown = breakable_paths("<td><code>a_b/t_c.py::test_it_stops</code></td>")
    assert shown == "<td><code>a_b/<wbr>t_c.py::<wbr>test_<wbr>it_<wbr>stops</code></td>"


def test_drawings_are_marked_and_other_blocks_are_not():
    drawing, program = "<pre><code>brick ── link\n</code></pre>", "<pre><code>nxtdrive run\n</code></pre>"
    marked = drawing.replace("<pre>", '<pre class="drawing">')
    assert marked_drawings(program + drawing + "<p>─</p>" + program) == program + marked + "<p>─</p>" + program


def test_every_example_with_a_readme_is_a_page():
    assert {f"examples/{path.parent.name}/README.md" for path in (ROOT / "examples").glob("*/README.md")} <= set(
        pages()
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built so that a warning is an error."""
    for module in ("material", "mkdocstrings"):
        pytest.importorskip(module, reason="the extra `docs` builds the site")
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


@pytest.mark.slow
def test_the_site_has_no_broken_link_and_fetches_nothing_from_elsewhere(site):
    found = 0
    for page in site.rglob("*.html"):
        html = page.read_text(encoding="utf-8")
        assert not re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=\"?(https?:[^\s\">]*)", html), page.name
        for target in re.findall(r"(?:href|src)=\"?([^\s\">]+)", html):
            path = unquote(urlsplit(target).path)
            if not urlsplit(target).scheme and path and page.name != "404.html":
                assert (page.parent / path).exists(), f"{page.relative_to(site)}: {target}"
                found += 1
    assert found > 1000


@pytest.mark.slow
def test_lists_and_blocks_are_not_shown_as_text(site):
    """A list needs an empty line before it, and a block in a list four spaces; GitHub asks for neither."""
    for page in site.rglob("*.html"):
        html = re.sub(r"<pre.*?</pre>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for _, text in re.findall(r"<(p|li)>(.*?)</\1>", html, flags=re.DOTALL):
            assert not re.findall(r"\n *(?:[-*]|\d\d?\.) \S.*|```.*", text), page.name


@pytest.mark.slow
def test_the_reference_is_made_of_the_docstrings(site):
    driver = (site / "reference" / "driver.html").read_text(encoding="utf-8")
    for page in (site / "reference").iterdir():
        assert "::</p>" not in page.read_text(encoding="utf-8"), "a marker of another markup language"
    for told in ("Open a brick, check that it answers", "run_angle", "compass"):
        assert told in driver
