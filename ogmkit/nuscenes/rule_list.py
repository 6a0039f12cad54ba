"""All numbered rules: what is wrong where one is broken, and what to do then."""

from ogmkit.nuscenes.files import FILE_RULES
from ogmkit.nuscenes.plausible import FIGURES
from ogmkit.nuscenes.rules import rules

OTHER_RULES = {
    "R101": ("table is missing or unreadable", "extract the metadata archive again"),
    "R102": ("the dataset has no scene", "extract the metadata archive again"),
    "R404": ("scene lacks a camera or LiDAR that is used", "leave it out, or name others"),
    "R606": ("splits.json is unsound", "correct it"),
    "R807": ("no category is a vehicle", "name the dataset's own with --categories"),
}
"""Number → title and remedy, of rules that are neither on records, nor on files, nor figures."""


def all_rules() -> dict[str, tuple[str, str]]:
    """Number → title and remedy, in order of number."""
    of_records = {rule.id: (rule.title, rule.remedy) for rule in rules(complete=True)}
    of_figures = {figure.id: (figure.title, figure.remedy) for figure in FIGURES}
    return dict(sorted((of_records | of_figures | FILE_RULES | OTHER_RULES).items()))


def rules_markdown() -> str:
    """The table of rules for the documentation."""
    rows = (f"| {number} | {title} | {remedy} |" for number, (title, remedy) in all_rules().items())
    return "\n".join(("| rule | what is wrong | what to do |", "| --- | --- | --- |", *rows))
