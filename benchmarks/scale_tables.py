"""The table of scale, in markdown, from what the parts of `scale.py` have told."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from result_rows import NOT_RUN, row
from scale import NAME, parts_of

__all__ = ["NAME", "parts_of", "text"]
GIB_MIB = 1024

Figures = Mapping[str, Any]


@dataclass(frozen=True)
class Row:
    """A row.

    Attributes:
        what: in words.
        bound: in words; empty for none.
        needs: parts whose figures it is worked out from.
        value: called with these figures, in that order.
        shown: format of the value.
        holds: whether a value keeps the bound; None for none.
    """

    what: str
    bound: str
    needs: tuple[str, ...]
    value: Callable[..., float]
    shown: str = "{:.2f}×"
    holds: Callable[[float], bool] | None = None


def best(costs):
    """The least time: what else the machine does only adds."""
    return min(one["wall_s"] for one in costs)


def whole_s(figures):
    return figures["extract"]["wall_s"]


def two_s(figures):
    return best(figures["two"])


def speed_up(figures):
    return best(figures["one"]) / two_s(figures)


def a_frame_s(figures, name):
    return best(figures[name]) / figures["frames"]


def peak_gib(costs, name):
    return max(one[name] for one in costs) / GIB_MIB


def below(bound):
    return lambda value: value <= bound


def above(bound):
    return lambda value: value >= bound


SECONDS, GIB = "{:.1f} s", "{:.2f} GiB"
ROWS = (
    Row("first `extract`, which also decodes the masks", "", ("first",), whole_s, SECONDS),
    Row("`extract` of CAM_FRONT, two workers", "< 100 s", ("extract",), two_s, SECONDS, below(100)),
    Row("beside the bare warp, fill and h5py calls of two processes", "≤ 1.6×", ("extract",),
        lambda one: two_s(one) / min(one["bare"]), holds=below(1.6)),
    Row("two workers beside one", "≥ 1.85×", ("extract",), speed_up, holds=above(1.85)),
    Row("memory of all processes, mapped files left out", "≤ 1.40 GiB", ("extract",),
        lambda one: peak_gib(one["two"], "own_mib"), GIB, below(1.4)),
    Row("the same of the first run, while it decodes the largest mask", "≤ 1.40 GiB", ("first",),
        lambda one: peak_gib([one["extract"]], "own_mib"), GIB, below(1.4)),
    Row("mapped files (masks)", "", ("extract",), lambda one: peak_gib(one["two"], "mapped_mib"), GIB),
    Row("a frame's time beside that of a tenth of the scenes", "≤ 1.05×", ("extract", "tenth"),
        lambda one, tenth: a_frame_s(one, "two") / a_frame_s(tenth, "extract"), holds=below(1.05)),
    Row("six cameras beside one", "≤ 4×", ("extract", "six-cameras"),
        lambda one, six: whole_s(six) / two_s(one), holds=below(4)),
    Row("the same command over a finished run", "< 10 s", ("resume",), whole_s, SECONDS, below(10)),
    Row("`verify`: speed, sha256 and gunzip of the files being 1", "≥ 0.7×", ("verify",),
        lambda one: min(one["floor"]) / best(one["verify"]), holds=above(0.7)),
    Row("`check`: speed, reading the tables' files being 1", "≥ 0.7×", ("check",),
        lambda one: min(one["floor"]) / best(one["check"]), holds=above(0.7)),
    Row("`homography-fit`, two workers beside one", "≥ 1.85×", ("fit",), speed_up, holds=above(1.85)),
    Row("`render-footprints`, two workers beside one", "≥ 1.85×", ("footprints",), speed_up,
        holds=above(1.85)),
    Row("17,000 scenes: opened and planned, the first time", "", ("many-scenes",),
        lambda one: one["plan"][0]["wall_s"], SECONDS),
    Row("again", "", ("many-scenes",), lambda one: one["plan"][1]["wall_s"], SECONDS),
    Row("memory, mapped files left out", "< 1.86 GiB", ("many-scenes",),
        lambda one: peak_gib(one["plan"], "own_mib"), GIB, below(1.86)),
    Row("manifest of a million scenes: written", "", ("manifest",),
        lambda one: one["seconds"]["write"], SECONDS),
    Row("read", "", ("manifest",), lambda one: one["seconds"]["read"], SECONDS),
    Row("its size", "", ("manifest",), lambda one: one["bytes"] / 2**20, "{:.0f} MiB"),
    Row("memory of writing and reading it", "", ("manifest",), lambda one: one["peak_mib"] / 1024, GIB),
)  # fmt: skip


def text(bench):
    """A row for each claim, and whether it holds."""
    lines = [row("", "measured", "aim", ""), row("---", "---:", "---:", "---")]
    for one in ROWS:
        records = [bench.record(name) for name in one.needs]
        if None in records:
            lines.append(row(one.what, NOT_RUN, one.bound, ""))
            continue
        value = one.value(*(record["figures"] for record in records))
        verdict = "" if one.holds is None else "holds" if one.holds(value) else "**missed**"
        lines.append(row(one.what, one.shown.format(value), one.bound, verdict))
    return "\n".join(lines)
