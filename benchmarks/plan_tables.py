"""Tables of stage 2, in markdown, from what the parts of `planning.py` have told."""

import numpy as np
from bench_plans import TOLD
from comparisons import mean_difference, told
from planning import FROZEN, IMAGES, MASKS, NAME, PERCEPTION, parts_of
from result_rows import NOT_RUN, SEED, row, sorted_rows, system_of

from ogmkit.metrics.bootstrap import Estimate
from ogmkit.metrics.linear import LINEAR

KINDS = ("all", "speed changes", "course changes", "neither")
REGRESSION = "regression"
PAIRS = {
    MASKS: (
        ("mid-to-end-linear", LINEAR),
        ("lstm-ed-linear", LINEAR),
        ("mid-to-end-linear", "lstm-ed-linear"),
        ("mid-to-end", "lstm-ed"),
        ("mid-to-end", "mid-to-end-np"),
        (REGRESSION, LINEAR),
        ("regression-told", REGRESSION),
    ),
    IMAGES: (
        ("lstm-ed-linear", LINEAR),
        ("mid-to-end-linear", LINEAR),
        ("mid-to-end-linear-long", LINEAR),
        ("holistic-frozen", "holistic-cv-frozen"),
        ("holistic", "holistic-cv"),
        ("holistic", "holistic-frozen"),
        ("holistic-frozen", LINEAR),
        ("holistic-cv-frozen", LINEAR),
        ("holistic", LINEAR),
        ("holistic-cv", LINEAR),
    ),
    FROZEN: (
        ("holistic-frozen", "holistic-cv-frozen"),
        ("holistic-frozen", LINEAR),
        ("holistic-cv-frozen", LINEAR),
        ("lstm-ed-linear", LINEAR),
        ("mid-to-end-linear", LINEAR),
        ("holistic-frozen", "lstm-ed-linear"),
        ("holistic-cv-frozen", "lstm-ed-linear"),
        ("mid-to-end-linear", "lstm-ed-linear"),
        ("mid-to-end-linear", "holistic-frozen"),
        ("holistic-frozen-fine", "holistic-cv-frozen-fine"),
        ("holistic-frozen-fine", "holistic-frozen"),
        ("holistic-cv-frozen-fine", "holistic-cv-frozen"),
        ("mid-to-end-linear-fine", "mid-to-end-linear"),
    ),
}
TITLES = {
    MASKS: "True masks, 300 scenes",
    IMAGES: "Images, 112 scenes",
    FROZEN: "Images, 300 scenes, perception frozen",
}
PLACES = {
    "drivable camera full all": "drivable area in camera view",
    "drivable bev close fov": "from above, close by and in view",
    "vehicles camera full all": "vehicles in camera view",
    "vehicles bev close fov": "from above, close by and in view",
}
"""Of the perception's figures, and how they are told."""
__all__ = ["NAME", "parts_of", "text"]


def text(bench):
    """All of stage 2."""
    parts = []
    for world, title in TITLES.items():
        parts += [f"### {title}", figures(bench, world), differences(bench, world)]
    parts.append(perception(bench))
    return "\n\n".join(parts)


def figures(bench, world):
    """A row for each run, then the controls."""
    header = [f"{metric} {reading} {horizon_s:g} s" for metric, reading, horizon_s in TOLD]
    lines = ["**Metres (NLL in nats, points in vehicles in %): at the horizon, or the mean up to it**", ""]
    lines += [row("", *header), row("---", *["---:"] * len(header))]
    for name, found in _rows(bench, world):
        cells = [NOT_RUN] if found is None else [_cell(metric, value) for metric, value in found.items()]
        lines.append(row(name, *cells, *[""] * (len(header) - len(cells))))
    return "\n".join(lines)


def differences(bench, world):
    """Pairs of rows on the same sequences: ADE, mean up to 2.5 s and over seeds, with intervals by scene."""
    sums = _sums(bench, world)
    header = ["", *KINDS, "all, by scene and seed", "each seed"]
    lines = ["**ADE in metres, mean up to 2.5 s, one less the other on the same sequences**", ""]
    lines += [row(*header), row("---", *["---:"] * (len(header) - 1))]
    for one, other in PAIRS[world]:
        name = f"{one} − {other}"
        if one not in sums or other not in sums:
            lines.append(row(name, NOT_RUN, *[""] * (len(header) - 2)))
            continue
        both = _paired(sums[one], sums[other])
        cells = [_away(*(side[kind] for side in both)) for kind in KINDS]
        of_all = [side["all"] for side in both]
        seeds = [(mine - its)[:, 0].sum() / mine[:, 1].sum() for mine, its in zip(*of_all, strict=True)]
        each = ", ".join(f"{seed:+.4f}" for seed in seeds).replace("-", "−")
        lines.append(row(name, *cells, _away(*of_all, over_seeds=True), each))
    return "\n".join(lines)


def perception(bench):
    """How good the masks are that the holistic planners begin with."""
    record = bench.record(PERCEPTION)
    if record is None:
        return f"Their perception: {NOT_RUN}."
    (found,) = record["figures"]["foreground_iou"].values()
    shown = [f"{name} {100 * found[place]:.1f} %" for place, name in PLACES.items()]
    return f"Foreground IoU of the perception that they begin with: {', '.join(shown)}."


def _rows(bench, world):
    """(name, figures or None): runs by system, then the controls."""
    trained = [
        one.name for one in bench.parts if one.name.startswith(f"{world}/") and "train" in one.settings
    ]
    for part in sorted_rows(trained):
        record = bench.record(part)
        if record is None or "figures" in record["figures"]:
            yield part.partition("/")[2], None if record is None else _only(record["figures"]["figures"])
    controls = bench.record(f"{world}/controls")
    yield from [("controls", None)] if controls is None else controls["figures"]["figures"].items()


def _only(of_one):
    return next(iter(of_one.values()))


def _sums(bench, world):
    """{system: {seed: {kind: (scenes, 2)}}} of what has been run; a control's only seed is None."""
    found = {}
    for part in bench.parts:
        record = bench.record(part.name) if part.name.startswith(f"{world}/") else None
        for name, sums in (record or {"figures": {}})["figures"].get("ade_sums", {}).items():
            # A run is called by its system alone; which of them it is, its part says.
            row_name = part.name.partition("/")[2] if "train" in part.settings else name
            seed = SEED.search(row_name)
            arrays = {kind: np.array(one) for kind, one in sums.items()}
            found.setdefault(system_of(row_name), {})[seed and seed[1]] = arrays
    return found


def _paired(one, other):
    """{kind: (seeds, scenes, 2)} of both, of the seeds that both have; a control stands beside each."""
    if None in other:
        other = dict.fromkeys(one, other[None])
    seeds = [seed for seed in one if seed in other]
    return [{kind: np.stack([side[seed][kind] for seed in seeds]) for kind in KINDS} for side in (one, other)]


def _away(one, other, **how):
    return told(mean_difference(one, other, **how), "+.4f")


def _cell(metric, values):
    found = Estimate(*(np.asarray(np.nan if one is None else one) for one in values))
    return told(found, ".1f", 100) if metric.startswith("in_vehicle") else told(found, ".3f")
