"""The file: style, sections, data and script, then the pictures, written one after the other."""

import base64
import hashlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import fields
from importlib import resources
from typing import BinaryIO

from ogmkit import __version__
from ogmkit.base.files import read_text
from ogmkit.drawing.palette import THEMES, ThemeName
from ogmkit.report.html import Html, element, joined
from ogmkit.report.sections import Section

_THEME_NAMES = {"": "System", "light": "Light", "dark": "Dark"}


def write_page(
    file: BinaryIO,
    title: str,
    subtitle: str,
    sections: Sequence[Section],
    data: Html,
    pictures: BinaryIO | None,
) -> None:
    """Write the page.

    Args:
        file: to be written.
        title: of the page.
        subtitle: stands below.
        sections: in order.
        data: inert elements that the script reads.
        pictures: HTML of the pictures, from where it stands; None without any.
    """
    script = _static("report.js")
    head = (_head(title, script), _body(title, subtitle, sections), data)
    for part in (*head, Html(f"<script>{script}</script>\n")):
        file.write(part.encode("utf-8", "backslashreplace"))
    if pictures is not None:
        shutil.copyfileobj(pictures, file)
    file.write(b"</body></html>\n")


def _head(title: str, script: str) -> Html:
    """No address can be asked for anything, and no script runs but the page's own."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return joined(
        (
            Html('<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'),
            element("meta", http_equiv="Content-Security-Policy", content=policy),
            element("meta", name="viewport", content="width=device-width, initial-scale=1"),
            element("title", title),
            Html(f"<style>{_colours()}{_static('report.css')}</style></head>\n"),
        )
    )


def _body(title: str, subtitle: str, sections: Sequence[Section]) -> Html:
    links = (element("li", element("a", one.title, href=f"#{one.identity}")) for one in sections)
    inside = (
        element(
            "header", element("div", element("h1", title), element("p", subtitle)), _switch(), class_="top"
        ),
        element("nav", element("ul", *links), aria_label="Sections"),
        element("main", *(one.html() for one in sections)),
        element(
            "footer", f"Made by ogmkit {__version__}. This file needs nothing else, and asks for nothing."
        ),
    )
    return Html(f"<body>{element('div', *inside, class_='layout')}\n")


def _switch() -> Html:
    options = (
        element(
            "label",
            element("input", type="radio", name="theme", value=value, checked=not value),
            element("span", text),
        )
        for value, text in _THEME_NAMES.items()
    )
    return element("fieldset", element("legend", "Colours"), *options, class_="themes")


def _colours() -> Html:
    """The palette's colours as variables: the system's theme, or the one that is chosen."""
    dark, light = (Html(";".join(_variables(name))) for name in ("dark", "light"))
    rules = (
        f":root{{{light}}}.only-dark{{display:none}}",
        f"@media(prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}",
        ":root:not([data-theme=light]) .only-light{display:none}",
        ":root:not([data-theme=light]) .only-dark{display:block}}",
        f":root[data-theme=dark]{{{dark}}}:root[data-theme=dark] .only-light{{display:none}}",
        ":root[data-theme=dark] .only-dark{display:block}\n",
    )
    return Html("".join(rules))


def _variables(name: ThemeName) -> Iterator[str]:
    theme = THEMES[name]
    for one in fields(theme):
        red, green, blue = getattr(theme, one.name)
        yield f"--{one.name}:rgb({red} {green} {blue})"


def _static(name: str) -> str:
    with resources.as_file(resources.files(__package__) / name) as path:
        return read_text(path)
