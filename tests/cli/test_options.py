"""Shared options: what each gives to a command."""

import click
import pytest
from click.testing import CliRunner
from ogmkit_cli import options
from ogmkit_cli.grid_options import grid_options

from ogmkit.grid import GridSpec


@pytest.fixture
def parse():
    """Parse arguments with one option: `parse(option, ["--x", "1"])` gives the command's keywords."""

    def run(option, arguments):
        given = {}

        @click.command()
        @option
        def command(**keywords):
            given.update(keywords)

        result = CliRunner().invoke(command, arguments)
        if result.exit_code == 2:
            raise click.UsageError(result.output)
        assert result.exit_code == 0, result.output
        return given

    return run


@pytest.mark.parametrize(
    ("option", "arguments", "expected"),
    [
        (options.scenes_option, [], {"scenes": ()}),
        (
            options.scenes_option,
            ["--scenes", "scene-0061, scene-0103"],
            {"scenes": ("scene-0061", "scene-0103")},
        ),
        (
            options.scenes_option,
            ["--scenes", "scene-0061", "--scenes", "scene-0103,scene-0553"],
            {"scenes": ("scene-0061", "scene-0103", "scene-0553")},
        ),
        (
            options.cameras_option("CAM_FRONT"),
            ["--camera", "CAM_BACK,CAM_FRONT_LEFT", "--camera", "CAM_FRONT"],
            {"cameras": ("CAM_BACK", "CAM_FRONT_LEFT", "CAM_FRONT")},
        ),
        (options.workers_option, ["--workers", "0"], {"workers": 1}),
        (options.splits_option, ["--split", "train"], {"splits": ("train",)}),
        (options.workers_option, [], {"workers": 1}),
        (options.cameras_option(), [], {"cameras": ()}),
        (options.cameras_option("CAM_FRONT"), [], {"cameras": ("CAM_FRONT",)}),
        (
            options.cameras_option("CAM_FRONT"),
            ["--camera", "CAM_BACK", "--camera", "CAM_FRONT_LEFT"],
            {"cameras": ("CAM_BACK", "CAM_FRONT_LEFT")},
        ),
    ],
)
def test_values(parse, option, arguments, expected):
    assert parse(option, arguments) == expected


@pytest.mark.parametrize(
    ("option", "arguments"),
    [
        (options.scenes_option, ["--scenes", "scene-0061,,scene-0103"]),
        (options.scenes_option, ["--scenes", ""]),
        (options.workers_option, ["--workers", "-1"]),
        (options.split_file_option, ["--split-file", "no-such-file.json"]),
    ],
)
def test_usage_errors(parse, option, arguments):
    with pytest.raises(click.UsageError):
        parse(option, arguments)


def test_sizes_are_given_and_received_as_height_by_width():
    assert options.size("450x800") == (450, 800)
    assert options.size((450, 800)) == (450, 800)


@pytest.mark.parametrize(
    "text", ["800", "800x", "x450", "0x450", "-800x450", "800x450x3", "1e3x450", "800000x450"]
)
def test_what_is_not_a_size(text):
    with pytest.raises(click.BadParameter, match="HEIGHTxWIDTH"):
        options.size(text)


@pytest.mark.parametrize(
    ("arguments", "grid"),
    [
        ([], GridSpec()),
        (
            ["--cell-size", "0.25", "--rows", "400", "--columns", "220"],
            GridSpec(m_per_cell=0.25, rows=400, columns=220, ego_row=400, ego_column=120),
        ),
        (
            ["--rows", "400", "--ego-row", "200", "--ego-column", "275"],
            GridSpec(rows=400, ego_row=200, ego_column=275),
        ),
    ],
)
def test_grid_options_keep_the_ego_where_the_paper_has_it_unless_told(parse, arguments, grid):
    assert parse(grid_options, arguments) == {"grid": grid}
