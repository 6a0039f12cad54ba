"""HTML that what it shows can't break: all text is escaped unless it is `Html` already."""

import html
import json
from collections.abc import Iterable

_EMPTY = {"img", "input", "meta"}
"""Elements that hold nothing."""


class Html(str):
    """Text that is HTML."""

    __slots__ = ()


def escaped(content: object) -> Html:
    """Anything as HTML: text escaped, `Html` as it is, nothing for None, sequences in a row."""
    if isinstance(content, Html):
        return content
    if content is None:
        return Html("")
    if isinstance(content, list | tuple):
        return joined(content)
    return Html(html.escape(str(content)))


def joined(parts: Iterable[object]) -> Html:
    """Parts in a row."""
    return Html("".join(map(escaped, parts)))


def element(name: str, /, *children: object, **attributes: object) -> Html:
    """An element such as `element("a", "Frames", href="#frames", class_="quiet")`.

    Args:
        name: of the element.
        *children: as `escaped` takes them.
        **attributes: a last underscore is left out, others are hyphens. None and False leave an attribute
            out, True names it alone.
    """
    stated = "".join(
        f" {_attribute(key)}" if value is True else f' {_attribute(key)}="{html.escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None and value is not False
    )
    closing = "" if name in _EMPTY else f"{joined(children)}</{name}>"
    return Html(f"<{name}{stated}>{closing}")


def inert(identity: str, text: str, kind: str = "text/plain") -> Html:
    """Text that the browser keeps and does nothing with; `text` must hold no `<`.

    Raises:
        ValueError: it does.
    """
    if "<" in text:
        raise ValueError(f"{identity}: inert text holds a sign that could end it")
    return Html(f'<script type="{kind}" id="{html.escape(identity)}">{text}</script>\n')


def inert_json(identity: str, content: object) -> Html:
    """JSON in which nothing can end the element that holds it: in ASCII, `<`, `>` and `&` as numbers."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return inert(identity, text, "application/json")


def _attribute(key: str) -> str:
    return key.removesuffix("_").replace("_", "-")
