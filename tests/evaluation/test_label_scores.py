"""Grids of other networks scored by a definition: by hand, and refused by the field that differs."""

import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import DataFileError, SettingsError, ShardError
from ogmkit.evaluation.formats import as_csv, as_json, as_markdown
from ogmkit.evaluation.label_scores import require_one_table, score_predictions
from ogmkit.labels.catalogue import PRESETS
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

NAMES = ("paper", "lss", "cvt", "pon", "pointbev")


@pytest.fixture(scope="module")
def shards(shared_folder, extract_all, tiny_dataroot, sample_grid):
    """Labels by several names beside the paper's; tests only read them."""
    settings = ExtractSettings(TargetSettings(sample_grid, no_map=True), definitions=NAMES)
    return shared_folder("scored", lambda folder: extract_all(tiny_dataroot, folder, settings)) / "out"


@pytest.fixture(scope="module")
def stored(shards):
    """Tokens and arrays of all samples: `stored(place, below, *names)`."""

    def read(place, below, *names):
        tokens, arrays = [], {name: [] for name in names}
        for entry in read_manifest(shards).shards:
            with Shard(shards / entry.file) as shard:
                tokens += shard.strings(place, "sample_token")
                for name in names:
                    arrays[name].append(shard.dataset(place, f"{below}{name}")[:])
        return tokens, {name: np.concatenate(parts) for name, parts in arrays.items()}

    return read


def write(path, tokens, arrays, definition=None):
    if path.suffix == ".npz":
        more = {} if definition is None else {"definition": definition}
        np.savez(path, sample_token=tokens, **arrays, **more)
        return path
    with h5py.File(path, "w") as h5:
        h5["sample_token"] = tokens
        for name, array in arrays.items():
            h5[name] = array
        if definition is not None:
            h5.attrs["definition"] = definition
    return path


def values(evaluation):
    return {(one.system, one.target): one.value for one in evaluation.figures}


@pytest.mark.parametrize("name", ["grids.npz", "grids.h5"])
def test_the_labels_themselves_score_one(shards, stored, tmp_path, name):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    path = write(tmp_path / name, tokens, arrays, json.dumps(PRESETS["lss"].to_dict()))
    found = score_predictions(shards, "lss", [path])
    assert values(found) == {(name, "vehicle"): 1.0}
    assert (found.frames, found.frames_there, found.definition, found.version) == (16, 16, "lss", 1)


def test_probabilities_are_cut_at_the_threshold(shards, stored, tmp_path):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    soft = np.where(arrays["vehicle"] > 0, 0.6, 0.4).astype(np.float16)
    path = write(tmp_path / "grids.npz", tokens[:3], {"vehicle": soft[:3]})
    assert values(score_predictions(shards, "lss", [path])) == {("grids.npz", "vehicle"): 1.0}
    low = score_predictions(shards, "lss", [path], threshold=0.3)
    share = arrays["vehicle"][:3].mean()
    assert values(low)["grids.npz", "vehicle"] == pytest.approx(share)
    assert (low.frames, low.frames_there) == (3, 8)


@pytest.mark.parametrize(
    ("name", "place", "beside", "counts"),
    [
        ("cvt", "SURROUND", "visibility", lambda array: array >= 2),
        ("pointbev", "SURROUND", "valid", lambda array: array > 0),
        ("pon", "CAM_FRONT", "ignore", lambda array: array == 0),
    ],
)
def test_only_cells_count_that_the_definition_counts(shards, stored, tmp_path, name, place, beside, counts):
    target = "car" if name == "pon" else "vehicle"
    tokens, arrays = stored(place, f"labels/{name}/", target, beside)
    counted = counts(arrays[beside])
    assert not counted.all()
    wrong_elsewhere = np.where(counted, arrays[target], 1 - arrays[target]).astype(np.uint8)
    path = write(tmp_path / "grids.h5", tokens, {target: wrong_elsewhere})
    found = score_predictions(shards, name, [path])
    expected = 1.0 if (arrays[target][counted] > 0).any() else None
    assert expected is None or values(found)["grids.h5", target] == expected
    everywhere = write(tmp_path / "full.h5", tokens, {target: np.ones_like(arrays[target])})
    share = (arrays[target][counted] > 0).mean()
    found = score_predictions(shards, name, [everywhere])
    assert values(found)["full.h5", target] == pytest.approx(share)


def test_the_papers_labels_can_be_scored_too(shards, stored, tmp_path):
    tokens, arrays = stored("CAM_FRONT", "", "vehicles")
    path = write(tmp_path / "grids.npz", tokens, arrays)
    found = score_predictions(shards, "paper", [path], split="train")
    assert values(found) == {("grids.npz", "vehicles"): 1.0}
    assert found.frames == found.frames_there == 8


def test_labels_without_a_map_are_of_the_same_definition(shards, stored, tmp_path):
    tokens, arrays = stored("SURROUND", "labels/cvt/", "vehicle")
    path = write(tmp_path / "grids.npz", tokens, arrays, json.dumps(PRESETS["cvt"].to_dict()))
    assert values(score_predictions(shards, "cvt", [path]))["grids.npz", "vehicle"] == 1.0


def changed(definition, **fields):
    return json.dumps(replace(definition, **fields).to_dict())


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ("fiery", "beside is instance,visibility here but  there"),
        (changed(PRESETS["lss"], frame="lidar-ego-yaw"), "frame is lidar-ego-yaw here but lidar-ego there"),
        (changed(PRESETS["lss"], version=2), "version is 2 here but 1 there"),
        (changed(PRESETS["lss"], counted="valid"), "counted is valid here but all there"),
        (
            changed(PRESETS["lss"], filters=replace(PRESETS["lss"].filters, min_visibility=2)),
            "filters.min_visibility is 2 here but 0 there",
        ),
    ],
)
def test_grids_of_another_definition_are_refused_by_the_field(shards, stored, tmp_path, said, field):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    path = write(tmp_path / "grids.npz", tokens, arrays, said)
    with pytest.raises(SettingsError) as refused:
        score_predictions(shards, "lss", [path])
    name = said if said == "fiery" else "lss"
    message = str(refused.value)
    assert message == f"{path}: follows definition {name}, which can't share a column with lss: {field}"
    assert "\n" not in message


def test_labels_of_another_definition_are_refused_by_the_field(shards, stored, tmp_path):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    path = write(tmp_path / "grids.npz", tokens, arrays)
    copy = shutil.copytree(shards, tmp_path / "out")
    with h5py.File(copy / read_manifest(copy).shards[0].file, "r+") as h5:
        attributes = h5["SURROUND/labels/lss"].attrs
        record = json.loads(attributes["definition"])
        attributes["definition"] = json.dumps(record | {"version": 9})
    with pytest.raises(ShardError, match="labels lss are by another definition: version is 9 here but 1"):
        score_predictions(copy, "lss", [path])


def test_runs_are_scored_on_the_papers_labels(shards, tmp_path):
    with pytest.raises(SettingsError, match="follows definition paper, which can't share a column with lss"):
        require_one_table(shards, "lss", [tmp_path / "run"])
    with pytest.raises(SettingsError, match="is scored in a table of its own"):
        require_one_table(shards, "paper", [tmp_path / "run"])
    require_one_table(shards, "lss", [])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda tokens, arrays: (tokens, {"car": arrays["vehicle"]}), "unknown class 'car'"),
        (
            lambda tokens, arrays: (tokens, {"vehicle": arrays["vehicle"][:, 1:]}),
            r"has shape \(16, 199, 200\)",
        ),
        (lambda tokens, arrays: (["x", *tokens[1:]], arrays), "1 sample of 16 are not in the shards"),
        (lambda tokens, arrays: ([tokens[1], *tokens[1:]], arrays), "names a sample twice"),
        (lambda tokens, arrays: (tokens, {}), "has no array of a class"),
    ],
)
def test_files_that_cant_be_scored(shards, stored, tmp_path, change, said):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    path = write(tmp_path / "grids.npz", *change(tokens, arrays))
    with pytest.raises(SettingsError, match=said):
        score_predictions(shards, "lss", [path])


def test_what_is_asked_for_must_be_there(shards, stored, tmp_path):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    path = write(tmp_path / "grids.npz", tokens[:8], {"vehicle": arrays["vehicle"][:8]})
    with pytest.raises(SettingsError, match="has no labels 'stp3', only paper, lss"):
        score_predictions(shards, "stp3", [path])
    with pytest.raises(SettingsError, match="no scene is in split 'x'"):
        score_predictions(shards, "lss", [path], split="x")
    with pytest.raises(SettingsError, match="has no sample"):
        score_predictions(shards, "lss", [write(tmp_path / "all.npz", tokens, arrays), path])
    objects = write(tmp_path / "objects.npz", np.array(tokens, dtype=object), arrays)
    with pytest.raises(DataFileError, match=r"save tokens as text, with .astype\('U'\)"):
        score_predictions(shards, "lss", [objects])
    (tmp_path / "text.h5").write_text("no grids")
    for name in ("text.h5", "absent.npz"):
        with pytest.raises(DataFileError, match="can't be read"):
            score_predictions(shards, "lss", [tmp_path / name])


def test_each_row_names_its_definition(shards, stored, tmp_path):
    tokens, arrays = stored("SURROUND", "labels/lss/", "vehicle")
    found = score_predictions(shards, "lss", [write(tmp_path / "grids.npz", tokens, arrays)])
    (row,) = json.loads(as_json(found))
    assert (row["system"], row["definition"], row["version"], row["value"]) == ("grids.npz", "lss", 1, 1.0)
    assert as_csv(found).splitlines()[0].startswith("system,definition,version,target,cells,metric")
    assert "| grids.npz | lss v1 | vehicle | 100.00 |" in as_markdown(found)
