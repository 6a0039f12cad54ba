"""Parquet files and the card that Hugging Face's `datasets` reads them by."""

import io
import json

import cv2
import numpy as np
import pytest

from ogmkit.pipeline.exports.export import export_shards

parquet = pytest.importorskip(
    "pyarrow.parquet", reason="pyarrow is not installed: pip install 'ogmkit[parquet]'"
)


@pytest.fixture(scope="module")
def exported(tmp_path_factory, shards):
    out = tmp_path_factory.mktemp("parquet") / "out"
    export_shards(shards, out, "hf")
    return out


def picture(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)


@pytest.mark.parametrize("scene", ["scene-0001", "scene-0002"])
def test_every_value_of_every_frame_comes_back(shards, stored, exported, scene):
    rows = parquet.read_table(exported / f"cameras/{scene}.parquet").to_pylist()
    assert [(row["group"], row["frame"]) for row in rows] == [
        (camera, frame) for camera in ("CAM_BACK", "CAM_FRONT") for frame in range(8)
    ]
    values = {camera: stored(shards, scene, camera) for camera in ("CAM_BACK", "CAM_FRONT")}
    for row in rows:
        assert row["scene"] == scene
        for name, of_all in values[row["group"]].items():
            expected = of_all[row["frame"]]
            if name == "image":
                assert row[name] == {"bytes": expected.tobytes(), "path": None}
            elif isinstance(row[name], dict):
                found = picture(row[name]["bytes"])
                assert found.dtype == expected.dtype
                np.testing.assert_array_equal(found, expected)
            else:
                found = np.asarray(row[name], dtype=np.asarray(expected).dtype)
                np.testing.assert_array_equal(found.reshape(np.shape(expected)), expected)


def test_a_few_rows_are_written_at_a_time(exported):
    file = parquet.ParquetFile(exported / "cameras/scene-0001.parquet")
    assert file.metadata.num_rows == 16
    assert max(file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)) <= 16


def test_columns_that_a_group_lacks_are_null(labelled, tmp_path):
    export_shards(labelled, tmp_path / "out", "parquet")
    assert not (tmp_path / "out/README.md").exists()
    (row, *_) = parquet.read_table(tmp_path / "out/surround/scene-0001.parquet").to_pylist()
    assert {"scene", "group", "frame", "splits", "sample_token", "labels/fiery/vehicle"} <= row.keys()
    assert row["group"] == "SURROUND"


def test_all_files_of_a_table_have_one_schema(exported):
    one, other = (parquet.read_schema(exported / f"cameras/scene-000{number}.parquet") for number in (1, 2))
    assert one.equals(other, check_metadata=True)


def test_the_schema_says_what_columns_are_to_datasets(exported):
    schema = parquet.read_schema(exported / "cameras/scene-0001.parquet")
    features = json.loads(schema.metadata[b"huggingface"])["info"]["features"]
    assert list(features) == schema.names
    assert features["drivable"] == features["image"] == {"_type": "Image"}
    assert features["timestamp_us"] == {"dtype": "int64", "_type": "Value"}
    assert features["splits"] == {"feature": {"dtype": "string", "_type": "Value"}, "_type": "Sequence"}


def test_the_card_names_the_files_of_each_split(exported):
    yaml = pytest.importorskip("yaml", reason="YAML is not installed: pip install 'ogmkit[train]'")
    _, front, _ = (exported / "README.md").read_text().split("---\n")
    (config,) = yaml.safe_load(front)["configs"]
    assert (config["config_name"], config["default"]) == ("cameras", True)
    assert config["data_files"] == [
        {"split": "train", "path": ["cameras/scene-0001.parquet"]},
        {"split": "val", "path": ["cameras/scene-0002.parquet"]},
    ]


def test_datasets_loads_the_folder(exported, stored, shards):
    datasets = pytest.importorskip("datasets", reason="datasets is not installed")
    loaded = datasets.load_dataset(str(exported), cache_dir=str(exported.parent / "cache"))
    assert {name: len(split) for name, split in loaded.items()} == {"train": 16, "val": 16}
    values, row = stored(shards, "scene-0001", "CAM_FRONT"), loaded["train"][8]
    np.testing.assert_array_equal(np.asarray(row["drivable"]), values["drivable"][0])
    buffer = io.BytesIO()
    row["image"].save(buffer, "PNG")
    assert picture(buffer.getvalue()).shape == (90, 160, 3)
    np.testing.assert_array_equal(row["trajectory/future"], values["trajectory/future"][0])
