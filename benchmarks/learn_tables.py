"""Tables of stage 1, in markdown, from what the parts of `perception.py` have told."""

import numpy as np
from bench_grids import ALONE, AMONG_ALL, MEAN, NETWORK
from comparisons import in_range, iou_difference, median_ratio, told
from perception import FLAT, HILLS, NAME, RELIEF_M, TURNS_DEG, parts_of
from result_rows import NOT_RUN, row, sorted_rows

from ogmkit.homography.leave_out import RANGES_M
from ogmkit.metrics.bootstrap import estimate
from ogmkit.metrics.iou import CELLS, iou
from ogmkit.metrics.regions import REGIONS
from ogmkit.samples.spec import TARGETS

PLACES = ("camera", *(f"BEV {region}" for region in REGIONS))
READINGS = ("foreground IoU", "mean of foreground and background IoU")
WHERE = ("all cells", "cells in view only")
DRIVABLE, VEHICLES = range(2)
CLOSE, IN_VIEW = REGIONS.index("close"), CELLS.index("fov")
ASKED_M = (20.0, 40.0)
__all__ = ["NAME", "parts_of", "text"]


def text(bench):
    """All of stage 1."""
    parts = [asked(bench)]
    for world in (FLAT, HILLS):
        parts.append(f"### {world.capitalize()}: relief of {RELIEF_M[world]:g} m")
        parts += [grids(bench, world, at, cells) for at in range(len(READINGS)) for cells in (1, 0)]
        parts += [tuned(bench, world), errors(bench, world)]
    return "\n\n".join(parts)


def asked(bench):
    """What the benchmark was made to answer, with what counts as an answer."""
    lines = [row("what", "asked", "found"), row("---", "---", "---:")]
    for world in (FLAT, HILLS):
        for one in _parts(bench, world, "footprints-"):
            other = one.replace("footprints", "full-body")
            what = f"{world}: {_name(one)} − {_name(other)}, vehicles, BEV close in view, points of IoU"
            lines.append(row(what, "> 15" if world == FLAT else "", _away(bench, one, other)))
    for system in ("oft", "ved"):
        counts = _counts(bench, f"{FLAT}/{system}")
        for kind, name in (("bev", "at 0.5"), ("tuned_bev", "at the threshold of val")):
            found = NOT_RUN if counts is None else _share(_close(counts, kind))
            what = f"{FLAT}: {system}, vehicle IoU, BEV close in view, {name}, %"
            lines.append(row(what, "> 10", found))
    for name in (ALONE, AMONG_ALL):
        what = f"{FLAT}: ved on two scenes that it learnt {name}, vehicle IoU, BEV close in view, at 0.5, %"
        heart = _figures_of(bench, f"{FLAT}/ved-by-heart")
        found = NOT_RUN if heart is None else _share(_close(heart["counts"][name], "bev"))
        lines.append(row(what, "", found))
    lines += latents(bench)
    for head in ("four-point", "entries"):
        what = f"{HILLS}: network ({head}) / mean homography, median error at 20–40 m"
        lines.append(row(what, "≤ 0.7", _ratio(bench, head)))
    for angle in TURNS_DEG:
        what = f"the same (four-point), test cameras turned by up to {angle:g}°"
        lines.append(row(f"{HILLS}: {what}", "", _turned_ratio(bench, f"{angle:g}")))
    return "\n".join(lines)


def latents(bench):
    """What the latents of VED's networks for vehicles tell of an image."""
    figures = _figures_of(bench, f"{FLAT}/latents")
    if figures is None:
        return [row(f"{FLAT}: latents of ved", "", NOT_RUN)]
    return [
        row(
            f"{FLAT}: numbers of {_name(run)}'s latent of vehicles that vary with the image; spread of "
            "probabilities over images",
            "",
            f"{found['vehicles']['active']} of {found['vehicles']['of']}; {found['vehicles']['spread']:.4f}",
        )
        for run, found in figures["latents"].items()
    ]


def grids(bench, world, reading, cells):
    """One reading of the IoU: a row for each run, then those for free."""
    header = [f"{target} {place}" for target in TARGETS for place in PLACES]
    lines = [f"**{READINGS[reading]}, {WHERE[cells]}, %**", ""]
    lines += [row("", *header), row("---", *["---:"] * len(header))]
    for name, counts in _rows(bench, world):
        figures = [NOT_RUN] if counts is None else [*_figures(counts, cells, reading)]
        lines.append(row(name, *figures, *[""] * (len(header) - len(figures))))
    return "\n".join(lines)


def tuned(bench, world):
    """Thresholds that validation chose, and what neighbours are told apart."""
    header = ["drivable, threshold of val", "vehicles, threshold of val", "pairs found, %", "told apart, %"]
    lines = [
        "**Foreground IoU in BEV close in view at each run's own thresholds; neighbouring vehicles, %**",
        "",
    ]
    lines += [row("", *header), row("---", *["---:"] * len(header))]
    for name, counts in _rows(bench, world):
        if counts is None:
            lines.append(row(name, NOT_RUN, *[""] * 3))
            continue
        own = [_share(_close(counts, "tuned_bev", target)) for target in (DRIVABLE, VEHICLES)]
        pairs = np.array(counts["pairs"])
        parts = [told(estimate(pairs, lambda one, at=at: _part(one, at)), ".1f", 100) for at in (1, 2)]
        lines.append(row(name, *own, *parts))
    return "\n".join(lines)


def errors(bench, world):
    """Median and 90th percentile of homographies' errors, by range."""
    header = [f"{from_m:g}–{to_m:g} m" for from_m, to_m in RANGES_M]
    lines = ["**Error of vehicles' ground corners, m: median / 90th percentile (boxes)**", ""]
    lines += [row("homography", *header), row("---", *["---:"] * len(header))]
    for name, found in (*_errors(bench, world), *_turned_errors(bench, world)):
        cells = [NOT_RUN, "", ""] if found is None else [_spread(in_range(found, *one)) for one in RANGES_M]
        lines.append(row(name, *cells))
    return "\n".join(lines)


def _parts(bench, world, beginning):
    return [one.name for one in bench.parts if one.name.startswith(f"{world}/{beginning}")]


def _name(part):
    return part.partition("/")[2]


def _figures_of(bench, part):
    record = bench.record(part)
    return None if record is None else record["figures"]


def _counts(bench, part):
    """The counts of a part with one row; None where it hasn't been run."""
    figures = _figures_of(bench, part)
    return None if figures is None else next(iter(figures["counts"].values()))


def _rows(bench, world):
    """(name, counts or None) of each run and of each row for free."""
    trained = [
        one.name
        for one in bench.parts
        if one.name.startswith(f"{world}/") and "homography" in one.settings and "scenes" not in one.settings
    ]
    for part in sorted_rows(one for one in trained if _name(one) != "free"):
        yield _name(part), _counts(bench, part)
    free = _figures_of(bench, f"{world}/free")
    yield from [("rows for free", None)] if free is None else free["counts"].items()


def _errors(bench, world):
    """(name, errors by scene or None) of each homography."""
    free = _figures_of(bench, f"{world}/free")
    yield from [("fitted ones", None)] if free is None else free["errors"].items()
    for part in _parts(bench, world, "homography-"):
        figures = _figures_of(bench, part)
        yield _name(part), None if figures is None else figures["errors"][NETWORK]


def _turned_errors(bench, world):
    """The same where test scenes' cameras are turned."""
    for part in _parts(bench, world, "turned"):
        figures = _figures_of(bench, part)
        for angle in TURNS_DEG:
            for source, name in ((NETWORK, "homography-four-point"), (MEAN, MEAN)):
                found = None if figures is None else figures["errors"][f"{angle:g}"][source]
                yield f"{name}, cameras turned by up to {angle:g}°", found


def _figures(counts, cells, reading):
    """A row's cells."""
    image, bev = (estimate(np.array(counts[name]), iou) for name in ("image", "bev"))
    for target in range(len(TARGETS)):
        yield_at = [(image, (target, reading))]
        yield_at += [(bev, (target, region, cells, reading)) for region in range(len(REGIONS))]
        for found, place in yield_at:
            yield told(_at(found, place), ".1f", 100)


def _at(found, place):
    return type(found)(found.value[place], found.low[place], found.high[place])


def _close(counts, kind, target=VEHICLES):
    """(scenes, outcome) in BEV, close and in view."""
    return np.array(counts[kind])[:, target, CLOSE, IN_VIEW]


def _share(counts):
    """Foreground IoU in %; NA where nothing was counted."""
    return told(_at(estimate(counts, iou), (0,)), ".1f", 100)


def _part(pairs, at):
    with np.errstate(invalid="ignore"):
        return np.asarray(pairs[..., at] / pairs[..., at - 1])


def _away(bench, one, other):
    both = [_counts(bench, part) for part in (one, other)]
    if None in both:
        return NOT_RUN
    return told(iou_difference(*(_close(counts, "bev") for counts in both)), "+.1f", 100)


def _ratio(bench, head):
    network = _figures_of(bench, f"{HILLS}/homography-{head}")
    free = _figures_of(bench, f"{HILLS}/free")
    if network is None or free is None:
        return NOT_RUN
    return _medians(network["errors"][NETWORK], free["errors"][MEAN])


def _turned_ratio(bench, angle):
    turned = _figures_of(bench, f"{HILLS}/turned")
    return (
        NOT_RUN
        if turned is None
        else _medians(turned["errors"][angle][NETWORK], turned["errors"][angle][MEAN])
    )


def _medians(network, mean):
    """Medians and their ratio at the range that is asked about."""
    found = [in_range(one, *ASKED_M) for one in (network, mean)]
    medians = " / ".join(f"{np.median(np.concatenate(one)):.2f} m" for one in found)
    return f"{medians}: {told(median_ratio(*found), '.2f')}"


def _spread(errors):
    values = np.sort(np.concatenate(errors))
    if not len(values):
        return "NA"
    median, most = (values[round(share * (len(values) - 1))] for share in (0.5, 0.9))
    return f"{median:.2f} / {most:.2f} ({len(values)})"
