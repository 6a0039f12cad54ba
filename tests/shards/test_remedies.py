from pathlib import Path

import pytest

from ogmkit.shards.remedies import footprints_command, homography_command

OUT = Path("out")


@pytest.mark.parametrize(
    ("source", "command"),
    [
        ("surface", "ogmkit homography-fit out --method surface"),
        ("four-point", "ogmkit homography-fit out --method four-point"),
        ("network", "ogmkit predict homography out --checkpoint RUN"),
        ("network-deep", "ogmkit predict homography out --checkpoint RUN"),
    ],
)
def test_the_command_of_a_homography(source, command):
    assert homography_command(OUT, source) == command


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("surface", "--method warp --homography surface"),
        ("network", "--method warp --homography network"),
        ("network-deep", "--method warp --homography network-deep"),
        ("surface-project", "--method project --homography surface"),
        ("full-body", "--method full-body"),
        ("large", "--masks large"),
    ],
)
def test_the_command_of_a_set_of_footprints(name, options):
    assert footprints_command(OUT, name) == f"ogmkit render-footprints out {options}"
