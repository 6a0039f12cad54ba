"""The site is built strictly, asks for nothing from elsewhere, and shows pages as code forges do."""

import functools
import http.server
import importlib.util
import os
import re
import subprocess
import sys
import threading
from html.parser import HTMLParser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NEEDED = ("mkdocs", "material", "mkdocstrings")
THEME_S_OWN = {
    "https://api.github.com/repos/",  # stars of a repository, where mkdocs.yml names one
    "https://api.github.com/users/",
    "https://unpkg.com/mermaid",  # where a page has a diagram of that kind
    "https://unpkg.com/resize-observer-polyfill",  # for browsers of before 2020
    "https://clipboardjs.com/",  # in a comment
}
"""Addresses in the theme's scripts; no page gives it a reason to ask for one."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}: pip install 'ogmkit[docs]'")
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", out],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return out


class Page(HTMLParser):
    """What a page loads, what its paragraphs say outside of code, and its classes."""

    def __init__(self, path):
        super().__init__()
        self.loads, self.classes, self.scripts, self.prose, self._inside = [], set(), [], [], []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.classes.update((values.get("class") or "").split())
        if tag == "link" and values.get("rel") != "canonical":
            self.loads.append(values["href"])
        if tag != "a":
            self.loads += [values[name] for name in ("src", "poster", "data", "action") if values.get(name)]
            self.loads += re.split(r"[\s,]+", values.get("srcset") or "")
        self.loads += urls_of_css(values.get("style") or "")
        if tag in ("p", "code", "script", "style"):
            self._inside.append(tag)

    def handle_endtag(self, tag):
        if self._inside[-1:] == [tag]:
            self._inside.pop()
        if tag == "p":
            self.prose.append("\n")

    def handle_data(self, data):
        match self._inside[-1:]:
            case ["p"]:
                self.prose.append(data)
            case ["script"]:
                self.scripts.append(data)
            case ["style"]:
                self.loads += urls_of_css(data)


def urls_of_css(text):
    return re.findall(r"""(?:url\(|@import\s+)["']?([^"')\s;]+)""", text)


def elsewhere(loads):
    return [load for load in loads if re.match(r"(?:[a-z]+:)?//", load)]


@pytest.fixture(scope="module")
def pages(site):
    return {path.relative_to(site).as_posix(): Page(path) for path in sorted(site.rglob("*.html"))}


def test_every_page_of_the_repository_is_there(pages):
    docs = ROOT / "docs"
    expected = {f"docs/{path.relative_to(docs).with_suffix('.html')}" for path in docs.rglob("*.md")}
    expected = {name.replace("README.html", "index.html") for name in expected}

    assert expected | {"index.html", "docs/reference/commands.html", "docs/reference/python.html"} <= set(
        pages
    )


def test_no_request_leaves_the_site(site, pages):
    assert len(pages) > 30
    for name, page in pages.items():
        assert elsewhere(page.loads) == [], name
        assert not any(re.search(r"https?://", script) for script in page.scripts), name
        assert not page.classes & {"mermaid", "md-source"}, name
    styles = [path.read_text(encoding="utf-8") for path in site.rglob("*.css")]
    assert styles
    assert [load for text in styles for load in elsewhere(urls_of_css(text))] == []
    bundles = [path.read_text(encoding="utf-8") for path in (site / "assets/javascripts").glob("*.js")]
    assert {url for text in bundles for url in re.findall(r"https://[\w./-]+", text)} <= THEME_S_OWN


def test_a_page_that_loads_from_elsewhere_would_be_found(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(
        '<link rel="stylesheet" href="//a.org/a.css">'
        '<img src="https://b.org/b.png" srcset="https://c.org/c 2x">'
        '<p style="background: url(https://d.org/d)"><a href="https://fine.org">text</a>'
        "<style>@import 'https://e.org/e.css';</style>"
    )

    found = elsewhere(Page(path).loads)

    assert [re.search(r"//(\w)", load)[1] for load in found] == ["a", "b", "c", "d", "e"]


def test_nothing_of_the_markup_is_left_in_the_text(pages):
    for name, page in pages.items():
        text = "".join(page.prose)
        for left in (r"^\s*\|.*\|\s*$", r"^[-*] \S", r"^\d+\. \S", r"```", r"\]\([^)]*\)", r"\*\*", r"^#+ "):
            found = re.search(left, text, re.MULTILINE)
            assert found is None, f"{name}: {found[0]}"


@pytest.fixture
def address(site):
    """The site, served on this machine."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    handler = functools.partial(Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def test_a_browser_finds_a_word_and_asks_nobody_else(browse, address):
    with browse() as page:
        page.call("Page.navigate", url=f"{address}/index.html")
        page.wait("document.readyState === 'complete' && location.port !== ''")
        page.value("document.querySelector('[for=__search]').click()")
        page.value(
            "{const box = document.querySelector('.md-search__input'); box.focus();"
            "box.value = 'flatmobile'; box.dispatchEvent(new Event('input', {bubbles: true}))}"
        )
        page.wait("document.querySelectorAll('.md-search-result__item').length > 0")

        assert [url for url in page.asked if not url.startswith(f"{address}/")] == []
        assert page.said == []
