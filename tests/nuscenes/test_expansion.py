"""Map expansions: polygons with holes, lines, and what is wrong with a file."""

import json

import numpy as np
import pytest

from ogmkit.errors import DataFileError
from ogmkit.nuscenes.expansion import open_expansion

NODES = [(0, 0), (8, 0), (8, 6), (0, 6), (2, 2), (4, 2), (4, 4)]
CONTENT = {
    "node": [{"token": f"n{i}", "x": x, "y": y} for i, (x, y) in enumerate(NODES)],
    "polygon": [
        {
            "token": "holed",
            "exterior_node_tokens": ["n0", "n1", "n2", "n3"],
            "holes": [{"node_tokens": ["n4", "n5", "n6"]}, {"node_tokens": []}],
        },
        {"token": "plain", "exterior_node_tokens": ["n4", "n5", "n6"], "holes": []},
    ],
    "line": [
        {"token": "long", "node_tokens": ["n0", "n2", "n4"]},
        {"token": "short", "node_tokens": ["n0"]},
    ],
    "drivable_area": [
        {"token": "a", "polygon_tokens": ["holed", "plain"]},
        {"token": "b", "polygon_tokens": []},
    ],
    "walkway": [{"token": "c", "polygon_token": "plain"}],
    "lane_divider": [{"token": "d", "line_token": "long"}, {"token": "e", "line_token": "short"}],
    "stop_line": [{"token": "f", "polygon_token": "lost"}],
}


@pytest.fixture
def write(tmp_path):
    """Write a location's file: `write(text)` → the dataset's root."""
    (tmp_path / "maps" / "expansion").mkdir(parents=True)

    def write(text):
        (tmp_path / "maps" / "expansion" / "here.json").write_text(text)
        return tmp_path

    return write


def test_areas_and_lines(write):
    expansion = open_expansion(write(json.dumps(CONTENT)), "here")
    holed, plain = expansion.areas("drivable_area")
    assert holed.outer.tolist() == [[0, 0], [8, 0], [8, 6], [0, 6]]
    assert [hole.tolist() for hole in holed.holes] == [[[2, 2], [4, 2], [4, 4]]]
    assert (plain.holes, len(expansion.areas("walkway"))) == ((), 1)
    (line,) = expansion.lines("lane_divider")
    assert np.array_equal(line, [[0, 0], [8, 6], [2, 2]])
    assert expansion.areas("walkway") is expansion.areas("walkway")  # read once


def test_a_file_is_read_again_only_when_it_has_changed(write):
    root = write(json.dumps(CONTENT))
    assert open_expansion(root, "here") is open_expansion(root, "here")


@pytest.mark.parametrize(
    ("layer", "read"), [("stop_line", "areas"), ("ped_crossing", "areas"), ("road_divider", "lines")]
)
def test_a_layer_that_is_absent_or_names_what_isnt_there(write, layer, read):
    expansion = open_expansion(write(json.dumps(CONTENT)), "here")
    with pytest.raises(DataFileError, match=f"here.json: layer {layer} is absent or damaged"):
        getattr(expansion, read)(layer)


@pytest.mark.parametrize(("text", "said"), [("{", "no sound JSON"), ("[]", "no JSON object")])
def test_files_that_cant_be_read(write, text, said):
    with pytest.raises(DataFileError, match=said):
        open_expansion(write(text), "here")


def test_an_absent_file_names_the_remedy(tmp_path):
    with pytest.raises(DataFileError, match=r"nowhere.json: can't be read .*\(--no-map\)"):
        open_expansion(tmp_path, "nowhere")
