"""Documentation keeps pace: commands and options have help, and what the README shows is true."""

import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import COMMANDS, main

from ogmkit.shards import schema

README = Path(__file__).resolve().parents[1] / "README.md"


def readme():
    return README.read_text(encoding="utf-8")


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


def code_blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", readme(), re.MULTILINE | re.DOTALL)


def test_each_group_has_help():
    assert all(command(name).help for name in COMMANDS)


@pytest.mark.parametrize("name", EACH)
def test_each_command_and_each_of_its_options_has_help(name):
    assert EACH[name].help
    for parameter in EACH[name].params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.opts[0]}"


def test_every_design_section_that_code_refers_to_exists():
    root = README.parent
    headings = re.findall(r"^## (\d+)\.", (root / "docs/design.md").read_text(encoding="utf-8"), re.MULTILINE)
    for path in (*(root / "ogmkit").rglob("*.py"), *(root / "cli").rglob("*.py")):
        for found in re.findall(r"design\.md §(\d+)", path.read_text(encoding="utf-8")):
            assert found in headings, f"{path}: §{found}"


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
def test_each_command_stands_in_the_readme(name):
    assert f"`ogmkit {name}" in readme()


def test_options_that_the_readme_mentions_exist():
    known = {"--help"}.union(*map(option_names, EACH.values()))
    mentioned = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", readme()))

    assert mentioned
    assert mentioned <= known


def test_command_lines_in_the_readme_name_commands_and_their_options():
    shell = re.sub("#.*", "", "\n".join(code_blocks("sh")))
    lines = re.findall(r"\bogmkit ([a-z-]+)(?: ([a-z-]+))?(.*)", shell)

    assert {name for name, *_ in lines} <= set(COMMANDS)
    for name, word, rest in lines:
        found = EACH[name] if name in EACH else EACH[f"{name} {word}"]
        assert set(re.findall(r"(?<!\S)--?[a-z][a-z-]*", rest)) <= option_names(found), name


def test_the_schema_in_the_readme_is_the_schema():
    stated = re.search(r"<!-- schema: begin[^>]*-->\n(.*?)<!-- schema: end -->", readme(), re.DOTALL)

    assert stated[1].strip() == schema.markdown().strip()


def test_the_readmes_example_opens_a_shard_in_six_lines_of_h5py(tiny_dataroot, tmp_path):
    arguments = [
        "extract",
        tiny_dataroot,
        tmp_path / "shards",
        "--cell-size",
        1,
        "--rows",
        100,
        "--columns",
        55,
    ]
    result = CliRunner().invoke(main, [*map(str, arguments), "--cache-dir", str(tmp_path / "cache")])
    assert result.exit_code == 0, result.output
    shard = min((tmp_path / "shards").glob("*.h5"))
    (example,) = (block for block in code_blocks("python") if "h5py" in block)
    assert len([line for line in example.splitlines() if line]) <= 6

    code, replaced = re.subn(r'"[^"]+\.h5"', repr(str(shard)), example)
    assert replaced == 1
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.startswith("(100, 55)")
