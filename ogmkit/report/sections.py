"""Parts that several sections of the page are made of."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ogmkit.report.html import Html, element


@dataclass(frozen=True)
class Section:
    """A section of the page.

    Attributes:
        identity: its anchor.
        title: its heading.
        note: a sentence below; empty for none.
        body: what it holds.
    """

    identity: str
    title: str
    note: str
    body: Html

    def html(self) -> Html:
        """As it stands in the page."""
        heading = element("h2", self.title, id=f"{self.identity}-title")
        note = element("p", self.note, class_="lead") if self.note else None
        return element(
            "section", heading, note, self.body, id=self.identity, aria_labelledby=f"{self.identity}-title"
        )


def figure(title: str, picture: Html, note: str = "") -> Html:
    """A chart below its title."""
    caption = element("figcaption", element("h3", title), element("p", note) if note else None)
    return element("figure", caption, picture)


def facts(values: Mapping[str, object]) -> Html:
    """Names and what they are, in two columns; what is empty is left out."""
    return element(
        "dl",
        *(
            element("div", element("dt", name), element("dd", value))
            for name, value in values.items()
            if value not in (None, "", ())
        ),
        class_="facts",
    )


def tiles(values: Mapping[str, tuple[object, str]]) -> Html:
    """Large figures: name → figure, and a note below."""
    return element(
        "div",
        *(
            element(
                "div",
                element("span", name, class_="name"),
                element("strong", value),
                element("span", note, class_="of"),
                class_="tile",
            )
            for name, (value, note) in values.items()
        ),
        class_="tiles",
    )


def sortable(
    header: Iterable[str],
    rows: Iterable[Iterable[object]],
    caption: str = "",
    class_: str = "",
    groups: Sequence[tuple[str, int]] = (),
) -> Html:
    """A table whose headings are buttons that sort by their column.

    Args:
        header: the headings.
        rows: cells as `number` makes them, or text.
        caption: stands above; empty for none.
        class_: of the table.
        groups: headings over columns after the first: (text, how many columns).
    """
    above = (element("th", text, scope="colgroup", colspan=count) for text, count in groups)
    head = (
        element("th", element("button", one, type="button", data_sort=str(column)), scope="col")
        for column, one in enumerate(header)
    )
    body = (element("tr", *map(cell, row)) for row in rows)
    return element(
        "div",
        element(
            "table",
            element("caption", caption) if caption else None,
            element(
                "thead",
                element("tr", element("td"), *above, class_="groups") if groups else None,
                element("tr", *head),
            ),
            element("tbody", *body),
            class_=f"sortable {class_}".strip(),
        ),
        class_="scroll",
        tabindex="0",
    )


def cell(content: object) -> Html:
    """A cell; one that is a cell already stays."""
    if isinstance(content, Html) and content.startswith("<td"):
        return content
    return element("td", content)


def number(value: float, decimals: int = 0, factor: float = 1, unit: str = "") -> Html:
    """A cell with a number, by which its column is sorted; a dash where it isn't known."""
    if math.isnan(value):
        return element("td", "–", class_="n", data_v="")
    shown = factor * value
    return element("td", f"{shown:,.{decimals}f}{unit}", class_="n", data_v=f"{shown:g}")


def percent(value: float, decimals: int = 1) -> str:
    """A share in %; a dash where it isn't known."""
    return "–" if math.isnan(value) else f"{100 * value:.{decimals}f} %"
