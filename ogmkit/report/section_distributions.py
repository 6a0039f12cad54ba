"""How the frames are distributed: drivable area, vehicles, speeds, trajectories."""

from collections.abc import Iterable

from ogmkit.report import distributions
from ogmkit.report.charts import heat, histogram
from ogmkit.report.distributions import Distributions
from ogmkit.report.html import Html, element
from ogmkit.report.sections import Section, figure


def distributions_section(found: Distributions) -> Section:
    """Four histograms beside a map of futures."""
    return Section(
        "distributions",
        "Distributions",
        "Over all frames of all cameras; the last bar also has what lies beyond the axis.",
        element("div", element("div", *_histograms(found), class_="charts"), _ways(found), class_="beside"),
    )


def _histograms(found: Distributions) -> Iterable[Html]:
    if found.drivable.any():
        picture = histogram(found.drivable, distributions.SHARE, {0: "0", 0.5: "50 %", 1: "100 %"})
        yield figure("Drivable share", picture, "frames by the share of their cells")
    ranges = {0.0: "0", 50.0: "50 m", 100.0: "100 m"}
    yield figure(
        "Vehicles by range",
        histogram(found.ranges, distributions.RANGE_M, ranges),
        "boxes by distance from the ego",
    )
    crowd = {float(distributions.CROWD[0]): "0", 19.5: "20", float(distributions.CROWD[-1]): "40"}
    yield figure(
        "Vehicles in a frame", histogram(found.crowd, distributions.CROWD, crowd), "frames by their number"
    )
    speeds = {0.0: "0", 15.0: "15 m/s", 30.0: "30 m/s"}
    yield figure(
        "Speed", histogram(found.speed, distributions.SPEED_M_S, speeds), "frames by the ego’s last step"
    )


def _ways(found: Distributions) -> Html:
    picture = heat(found.ways, distributions.AHEAD_M, distributions.ASIDE_M)
    return figure("Futures", picture, "where the ego is in the next six steps")
