"""Training curves of runs side by side, and what the runs differ in."""

from collections.abc import Sequence

from ogmkit.report.charts import curves, style_of
from ogmkit.report.html import Html, element, joined
from ogmkit.report.sections import Section, figure, number, sortable
from ogmkit.report.trainings import Training, differing


def trainings_section(trainings: Sequence[Training]) -> Section:
    """Legend, a chart for each figure, and two tables."""
    names = [one.name for one in trainings]
    figures = dict.fromkeys(name for one in trainings for name in one.curves)
    charts = (_chart(name, trainings, names) for name in sorted(figures, key=_order))
    return Section(
        "trainings",
        "Trainings",
        "Each run has one colour throughout.",
        joined(
            (
                _legend(names),
                element("div", *charts, class_="charts wide"),
                _overview(trainings),
                _differences(trainings, names),
            )
        ),
    )


def _order(name: str) -> tuple[bool, str]:
    """What is validated stands first."""
    return not name.startswith("val/"), name


def _chart(name: str, trainings: Sequence[Training], names: Sequence[str]) -> Html:
    series = {number: one.curves[name] for number, one in enumerate(trainings) if name in one.curves}
    return figure(name, curves(series, names), ", ".join(names[number] for number in series))


def _legend(names: Sequence[str]) -> Html:
    entries = (
        element("li", element("span", class_=f"swatch {style_of(number)}"), name)
        for number, name in enumerate(names)
    )
    return element("ul", *entries, class_="legend")


def _overview(trainings: Sequence[Training]) -> Html:
    rows = (
        (
            one.name,
            one.system,
            ", ".join(f"{split} {count}" for split, count in one.scenes.items()),
            number(max((points[-1][0] for points in one.curves.values()), default=0)),
            ", ".join(one.checkpoints) or "none",
        )
        for one in trainings
    )
    return sortable(("Run", "System", "Scenes", "Steps", "Checkpoints"), rows)


def _differences(trainings: Sequence[Training], names: Sequence[str]) -> Html | None:
    different = differing(trainings)
    if not different:
        return None
    body = (
        element("tr", element("th", name, scope="row"), *(element("td", value) for value in values))
        for name, values in different.items()
    )
    head = element(
        "tr", element("th", "Setting", scope="col"), *(element("th", one, scope="col") for one in names)
    )
    table = element("table", element("thead", head), element("tbody", *body))
    summary = element("summary", f"Settings in which they differ: {len(different)}")
    return element("details", summary, element("div", table, class_="scroll", tabindex="0"))
