"""Documentation keeps pace: commands and options have help, and pages name only what exists."""

import re
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import COMMANDS, main

from ogmkit.labels.reference import definitions_markdown
from ogmkit.nuscenes.rule_list import rules_markdown
from ogmkit.shards.reference import schema_markdown
from ogmkit.workflow.reference import settings_markdown

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))


def text(page):
    return page.read_text(encoding="utf-8")


PICTURES = (".jpg", ".png", ".webp", ".svg")


def command(name):
    return main.get_command(click.Context(main), name)


def members(name):
    """The commands of a group by their full names, or the one command itself."""
    found = command(name)
    if not isinstance(found, click.Group):
        return {name: found}
    context = click.Context(found)
    return {f"{name} {member}": found.get_command(context, member) for member in found.list_commands(context)}


def option_names(found):
    return {flag for option in found.params for flag in (*option.opts, *option.secondary_opts)}


EACH = {full: found for name in COMMANDS for full, found in members(name).items()}
"""Commands as they are called, those of groups one by one."""


def test_each_group_has_help():
    assert all(command(name).help for name in COMMANDS)


@pytest.mark.parametrize("name", EACH)
def test_each_command_and_each_of_its_options_has_help(name):
    assert EACH[name].help
    for parameter in EACH[name].params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.opts[0]}"


def test_every_design_section_that_code_refers_to_exists():
    headings = re.findall(r"^## (\d+)\.", text(ROOT / "docs/design.md"), re.MULTILINE)
    for path in (*(ROOT / "ogmkit").rglob("*.py"), *(ROOT / "cli").rglob("*.py")):
        for found in re.findall(r"design\.md §(\d+)", text(path)):
            assert found in headings, f"{path}: §{found}"


DASK = ("--port", "--no-dashboard", "--nthreads", "--nworkers")
"""Options of `dask scheduler` and `dask worker`, which pages show too."""
METAVARS = {
    "--camera": "CHANNEL,…",
    "--scenes": "NAME,…",
    "--split-file": None,
    "--image-size": "HEIGHTxWIDTH",
    "--masks": "SET",
    "--homography": "SOURCE",
}
"""What an option of that name takes in every command that has it."""


@pytest.mark.parametrize("name", EACH)
def test_an_option_means_the_same_in_every_command(name):
    for option in EACH[name].params:
        for flag in METAVARS.keys() & set(option.opts):
            assert option.metavar == METAVARS[flag], f"{name} {flag}"
        assert not {"--set", "--num-workers"} & set(option.opts)


@pytest.mark.parametrize("name", EACH)
def test_no_help_shows_a_backslash(name):
    assert "\\" not in CliRunner().invoke(main, [*name.split(), "--help"]).output


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_is_in_the_readme(name):
    assert f"`ogmkit {name}" in text(ROOT / "README.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_options_that_a_page_mentions_exist(page):
    known = {"--help", *DASK}.union(*map(option_names, EACH.values()))

    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text(page))) <= known


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", text(page))
    for link in (link for link in links if "://" not in link):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", text(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def linked(page):
    """Files that a page leads to."""
    links = re.findall(r"\]\(([^)\s#]+)", text(page))
    return {(page.parent / link).resolve() for link in links if "://" not in link}


def test_every_page_can_be_reached_from_the_readme_in_two_steps():
    first = linked(ROOT / "README.md")
    second = {target for page in first & set(PAGES) for target in linked(page)}

    assert set(PAGES) - {ROOT / "README.md"} <= first | second


def test_each_concept_has_a_picture_that_a_script_makes():
    concepts = ROOT / "docs" / "concepts"
    scripts = "".join(text(ROOT / "docs" / name) for name in ("make_pictures.py", "concept_pictures.py"))
    for page in set(concepts.glob("*.md")) - {concepts / "README.md"}:
        (picture,) = re.findall(r"!\[[^\]]+\]\((\S+)\)", text(page))
        name = Path(picture).name if picture.startswith("../") else Path(picture).stem
        assert f'"{name}"' in scripts, page.name
        assert f"({page.name})" in text(concepts / "README.md")


def test_pictures_stay_small():
    sizes = {
        path.name: path.stat().st_size for path in (ROOT / "docs").rglob("*.*") if path.suffix in PICTURES
    }

    assert max(sizes.values()) < 400_000
    assert sum(sizes.values()) < 2_500_000


@pytest.mark.parametrize(
    ("page", "name", "made"),
    [
        ("shards.md", "schema", schema_markdown),
        ("settings.md", "settings", settings_markdown),
        ("data.md", "rules", rules_markdown),
        ("definitions.md", "definitions", definitions_markdown),
    ],
)
def test_generated_tables_are_up_to_date(page, name, made):
    pattern = rf"<!-- {name}: begin[^>]*-->\n(.*?)<!-- {name}: end -->"
    stated = re.search(pattern, text(ROOT / "docs" / page), re.DOTALL)

    assert stated[1].strip() == made().strip()
