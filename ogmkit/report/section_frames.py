"""Frames to leaf through, and examples of confusion: what stands in the page, and what its script reads."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ogmkit.report.html import Html, element, inert, inert_json, joined
from ogmkit.report.part import Part, PicturedFrame
from ogmkit.report.sections import Section
from ogmkit.samples.spec import TARGETS

_Options = Iterable[tuple[object, str]]
_AGREEMENT = {
    "drivable": "both drivable",
    "vehicle": "both vehicle",
    "first": "only true",
    "second": "only predicted",
}
_PLANE = {"drivable": "drivable", "vehicle": "vehicle", "first": "past", "future": "future"}
"""Colour of the theme → what it means."""


class FrameData:
    """What the script reads of all pictured frames, and where texts stand in it.

    Args:
        parts: of all shards, in the page's order.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        frames = [frame for part in parts for frame in part.frames]
        self.count = len(frames)
        self.scenes = [part.summary.scene for part in parts]
        self.cameras = sorted({frame.camera for frame in frames})
        self.lacks = sorted({lack for frame in frames for lack in frame.lacks})
        self.runs = list(dict.fromkeys(one.run for frame in frames for one in frame.predicted))
        self._rows = [
            self._row(scene, line, frame)
            for scene, part in enumerate(parts)
            for line, frame in enumerate(part.frames)
        ]

    def html(self) -> Html:
        """For the script."""
        names = ("scenes", "cameras", "lacks", "runs")
        content: dict[str, Any] = {name: getattr(self, name) for name in names}
        return inert_json("frames-data", content | {"targets": TARGETS, "rows": self._rows})

    def _row(self, scene: int, line: int, frame: PicturedFrame) -> list[object]:
        figures = (frame.time_s, frame.drivable, frame.vehicles, frame.speed_m_s)
        return [
            scene,
            self.cameras.index(frame.camera),
            frame.index,
            *map(_plain, figures),
            [self.lacks.index(lack) for lack in frame.lacks],
            [[self.runs.index(one.run), *map(_plain, one.iou)] for one in frame.predicted],
            line,
        ]


def pictures_html(scene: int, pictures: Sequence[Sequence[str]]) -> Html:
    """The pictures of a scene's frames, a line each, as text that only the script reads."""
    return inert(f"p{scene}", "\n".join("|".join(frame) for frame in pictures))


def frames_section(data: FrameData, most: int) -> Section:
    """Filters, the place for cards, and the dialog that shows one frame large."""
    validity = [("", "all"), ("whole", "lacking nothing"), ("lacking", "lacking something")]
    validity += [(str(number), text) for number, text in enumerate(data.lacks)]
    form = element(
        "form",
        element(
            "label", "Scene", element("input", name="scene", type="search", placeholder="part of a name")
        ),
        _select("Camera", "camera", [("", "all"), *enumerate(data.cameras)]),
        _select("Validity", "validity", validity),
        _select(
            "Order", "sort", [("", "scenes"), ("vehicles", "most vehicles"), *_worst(data, ", worst first")]
        ),
        element("output", id="shown", aria_live="polite"),
        class_="filters",
        id="filters",
    )
    note = (
        f"At most {most} of each scene, first one for each thing that frames lack, the rest evenly spread; "
        "besides, those that runs predict. Enter opens a frame, arrows leaf."
    )
    parts = (
        element("noscript", element("p", "Pictures need JavaScript.", class_="note")),
        form,
        _legend(_PLANE),
        element("div", class_="gallery", id="gallery"),
        element("div", id="more"),
        _viewer(),
    )
    return Section("frames", "Frames", note, joined(parts))


def examples_section(data: FrameData, heading: str) -> Section:
    """Where runs differ from the truth, the worst frames first."""
    form = element(
        "form", _select("Worst first by", "which", _worst(data, "")), class_="filters", id="confused"
    )
    parts = (
        form,
        _legend(_AGREEMENT),
        element("div", class_="gallery examples", id="examples-gallery"),
        element("div", id="examples-more"),
    )
    note = f"Drivable area, and vehicles, where prediction and truth differ in view: {heading}."
    return Section("examples", "Examples of confusion", note, joined(parts))


def _worst(data: FrameData, ending: str) -> list[tuple[object, str]]:
    return [
        (f"{run} {target}", f"{name}: IoU of {what}{ending}")
        for run, name in enumerate(data.runs)
        for target, what in enumerate(TARGETS)
    ]


def _select(label: str, name: str, options: _Options) -> Html:
    listed = (element("option", text, value=value) for value, text in options)
    return element("label", label, element("select", *listed, name=name))


def _legend(colours: Mapping[str, str]) -> Html:
    entries = (
        element("li", element("span", class_="swatch", style=f"--c:var(--{colour})"), text)
        for colour, text in colours.items()
    )
    return element("ul", *entries, class_="legend")


def _viewer() -> Html:
    buttons = {"before": "← Previous", "after": "Next →", "close": "Close"}
    head = (
        element("h2", id="viewer-title"),
        element("span", id="viewer-place"),
        *(
            element("button", text, type="button", class_="plain", id=f"viewer-{name}")
            for name, text in buttons.items()
        ),
    )
    return element(
        "dialog",
        element("div", *head, class_="head"),
        element("div", id="viewer-pictures", class_="big"),
        element("dl", id="viewer-facts", class_="facts"),
        id="viewer",
        aria_labelledby="viewer-title",
    )


def _plain(value: float) -> float | None:
    """A number as JSON has it, short; null where it isn't known."""
    return None if math.isnan(value) else round(value, 4)
