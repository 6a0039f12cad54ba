"""How sound it is: problems of the shards, rules that the dataset breaks, and frames that lack something."""

from collections.abc import Iterable, Sequence

from ogmkit.base.names import with_number
from ogmkit.report.html import Html, element, joined
from ogmkit.report.part import Part
from ogmkit.report.sections import Section, number, sortable
from ogmkit.report.soundness import Soundness, counted_invalid, counted_left_out

_MOST = 200
"""Problems that are listed."""


def sound_section(soundness: Soundness, parts: Sequence[Part]) -> Section:
    """Verdicts, then what is wrong, then what frames lack."""
    invalid = counted_invalid(one for part in parts for one in part.invalid)
    left_out = counted_left_out(one for part in parts for one in part.left_out)
    rows = [("invalid", one.camera, one.of, one.reason, number(one.frames)) for one in invalid]
    rows += [("left out", one.camera, "frame", one.reason, number(one.frames)) for one in left_out]
    lacking = sortable(("State", "Camera", "Of", "Why", "Frames"), rows, "Frames that lack something")
    return Section(
        "sound",
        "How sound it is",
        "",
        joined(
            (
                element("div", _verified(soundness), _checked(soundness), class_="verdicts"),
                lacking if rows else element("p", "No frame lacks anything.", class_="note"),
            )
        ),
    )


def _verified(soundness: Soundness) -> Html:
    problems = soundness.verified
    if problems is None:
        return _verdict("Shards", "not verified", soundness.not_verified, "unknown", ())
    lines = [element("li", element("b", one.file), f" {one.message}") for one in problems[:_MOST]]
    state = with_number(len(problems), "problem") if problems else "sound"
    note = "ogmkit verify: schema, checksums, and whether values agree"
    return _verdict("Shards", state, note, "bad" if problems else "good", lines, len(problems) - len(lines))


def _checked(soundness: Soundness) -> Html:
    findings = soundness.checked
    if findings is None:
        return _verdict("Dataset", "not checked", soundness.not_checked, "unknown", ())
    errors = sum(one.severity == "error" for one in findings)
    lines = [
        element(
            "li",
            element("b", f"{one.rule} {one.severity}"),
            f" {one.title} ({one.count:,}×) ",
            element("span", "; ".join(one.examples[:2]), class_="note"),
        )
        for one in findings
    ]
    state = ", ".join(
        with_number(count, noun)
        for count, noun in ((errors, "error"), (len(findings) - errors, "warning"))
        if count
    )
    note = "ogmkit check: numbered rules over tables and files"
    return _verdict(
        "Dataset", state or "sound", note, "bad" if errors else "fair" if findings else "good", lines
    )


def _verdict(what: str, state: str, note: str, kind: str, lines: Iterable[Html], more: int = 0) -> Html:
    listed = [*lines, *([element("li", f"and {more:,} more")] if more else [])]
    return element(
        "div",
        element("p", element("span", what, class_="name"), element("strong", state), class_="head"),
        element("p", note, class_="note"),
        element("ul", *listed) if listed else None,
        class_=f"verdict {kind}",
    )
