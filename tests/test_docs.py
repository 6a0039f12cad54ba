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


def option_names(name):
    return {flag for option in command(name).params for flag in (*option.opts, *option.secondary_opts)}


def code_blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", readme(), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_and_each_of_its_options_has_help(name):
    assert command(name).help
    for parameter in command(name).params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{name} {parameter.opts[0]}"


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_stands_in_the_readme(name):
    assert f"`ogmkit {name}" in readme()


def test_options_that_the_readme_mentions_exist():
    known = {"--help"}.union(*(option_names(name) for name in COMMANDS))
    mentioned = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", readme()))

    assert mentioned
    assert mentioned <= known


def test_command_lines_in_the_readme_name_commands_and_their_options():
    shell = re.sub("#.*", "", "\n".join(code_blocks("sh")))
    lines = re.findall(r"\bogmkit ([a-z-]+)(.*)", shell)

    assert {name for name, _ in lines} <= set(COMMANDS)
    for name, rest in lines:
        assert set(re.findall(r"(?<!\S)--?[a-z][a-z-]*", rest)) <= option_names(name), name


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
