"""Normalisation taken from images without labels: exact statistics, and nothing else changes."""

import json
import shutil

import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, OutputError, SettingsError
from ogmkit.learn.adaptation import Adaptation
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.models.recalibration import batch_norms
from ogmkit.learn.predict import adapt as module
from ogmkit.learn.predict.adapt import adapt
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.run_summary import summarise_checkpoint
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import SampleSpec

CAMERAS = ("CAM_BACK", "CAM_FRONT")
SEEING = [name for name, entry in CATALOGUE.items() if entry.inputs == "images"]
STATISTICS = ("running_mean", "running_var", "num_batches_tracked")


@pytest.fixture
def make(tmp_path, make_run, sample_grid):
    def run(system="footprints", **settings):
        return make_run(tmp_path / system, system, sample_grid, CAMERAS, **settings)

    return run


def first_norm(run):
    return batch_norms(open_run(run).model)[0]


def first_inputs(run, shards, scenes, cameras=CAMERAS):
    """What the first normalisation is given, (N, C, h, w), of all frames; no other layer comes before it."""
    index = index_frames(shards, scenes, cameras, needs=SampleSpec((64, 96)))
    dataset = FrameDataset(index, SampleSpec((64, 96)))
    network, given = open_run(run).model, []
    batch_norms(network)[0].register_forward_pre_hook(lambda layer, inputs: given.append(inputs[0]))
    with torch.inference_mode():
        network.look({"image": torch.stack([dataset[i]["image"] for i in range(len(dataset))])})
    return given[0]


def test_statistics_are_those_of_the_images(make, tmp_path, sample_shards):
    run = make()
    summary = adapt(
        run, sample_shards, tmp_path / "out", choice=Choice(scenes=("scene-0002",)), batch_size=100
    )

    inputs = first_inputs(run, sample_shards, ("scene-0002",)).double()
    found = first_norm(tmp_path / "out")
    assert summary.images == len(inputs) == 16
    assert summary.layers == len(batch_norms(open_run(run).model)) > 10
    torch.testing.assert_close(found.running_mean.double(), inputs.mean((0, 2, 3)), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(found.running_var.double(), inputs.var((0, 2, 3)), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_a_share_lies_between_the_run_and_the_images(make, tmp_path, sample_shards, share):
    run, choice = make(), Choice(limit=4)
    # A new network's statistics are 0 and 1: others tell which is weighted how.
    for name, images in (("former", Choice(limit=3)), ("images", choice)):
        adapt(run if name == "former" else tmp_path / "former", sample_shards, tmp_path / name, choice=images)
    adapt(tmp_path / "former", sample_shards, tmp_path / "both", choice=choice, share=share)

    there, new, found = (batch_norms(open_run(tmp_path / one).model) for one in ("former", "images", "both"))
    for one, other, between in zip(there, new, found, strict=True):
        for kind in ("running_mean", "running_var"):
            expected = (1 - share) * getattr(one, kind) + share * getattr(other, kind)
            torch.testing.assert_close(getattr(between, kind), expected)
    assert not torch.allclose(there[0].running_mean, new[0].running_mean, rtol=1e-3)
    assert summarise_checkpoint(tmp_path / "both" / "best.ckpt").adapted["share"] == share


@pytest.mark.parametrize("share", [0.0, -0.5, 1.01, float("nan")])
def test_a_share_out_of_range_is_refused(make, tmp_path, sample_shards, share):
    with pytest.raises(SettingsError, match="share must be over 0 and at most 1"):
        adapt(make(), sample_shards, tmp_path / "out", share=share)
    assert not (tmp_path / "out").exists()


def test_checkpoints_that_name_no_share_are_the_images_alone():
    made = Adaptation("run", "00", "shards", ("scene-0001",), 4, 0.5).to_dict()
    del made["share"]
    assert Adaptation.from_dict(made).share == 1


def test_several_batches_count_alike(make, tmp_path, sample_shards):
    """The mean of equal batches' means is that of all images; 8 images fill two batches of three."""
    run, choice, told = make(), Choice(limit=8), []
    for size in (8, 4, 3):
        adapt(
            run,
            sample_shards,
            tmp_path / f"{size}",
            choice=choice,
            batch_size=size,
            on_progress=lambda *done: told.append(done),
        )
    one, two = (first_norm(tmp_path / size).running_mean for size in ("8", "4"))
    torch.testing.assert_close(one, two, rtol=1e-4, atol=1e-5)
    assert told == [(8, 8), (4, 8), (8, 8), (3, 6), (6, 6)]
    assert summarise_checkpoint(tmp_path / "3" / "best.ckpt").adapted["images"] == 6


@pytest.mark.parametrize("system", SEEING)
def test_nothing_but_statistics_changes_in_any_system_that_sees_images(
    make, tmp_path, sample_shards, contents, system
):
    run = make(system)
    before = contents(run)
    adapt(run, sample_shards, tmp_path / "out", choice=Choice(limit=4), batch_size=2)

    assert contents(run) == before
    there, here = (open_run(one).weights for one in (run, tmp_path / "out"))
    changed = {name for name in there if not torch.equal(there[name].nan_to_num(), here[name].nan_to_num())}
    statistics = {name for name in there if name.rpartition(".")[2] in STATISTICS}
    assert changed == statistics
    assert open_run(tmp_path / "out").model.training is False


def test_images_of_a_folder_give_what_shards_of_them_give(make, tmp_path, sample_shards):
    run, images = make(), tmp_path / "images"
    images.mkdir()
    with h5py.File(sample_shards / "scene-0001.h5") as shard:
        for number, data in enumerate(shard["CAM_FRONT/image"][:]):
            (images / f"{number}.jpg").write_bytes(np.asarray(data, np.uint8).tobytes())
    choice = Choice(scenes=("scene-0001",), cameras=("CAM_FRONT",))
    adapt(run, sample_shards, tmp_path / "of-shards", choice=choice)
    adapt(run, images, tmp_path / "of-images")

    for of_shards, of_images in zip(
        *(batch_norms(open_run(tmp_path / name).model) for name in ("of-shards", "of-images")), strict=True
    ):
        torch.testing.assert_close(of_shards.running_mean, of_images.running_mean)
        torch.testing.assert_close(of_shards.running_var, of_images.running_var)


def test_the_new_run_says_where_it_comes_from_and_which_scenes_have_taught_it(make, tmp_path, sample_shards):
    run = make()
    splits = {"train": ["scene-0001"], "val": ["scene-0002"]}
    (run / "splits.json").write_text(json.dumps(splits))
    adapt(run, sample_shards, tmp_path / "out", choice=Choice(scenes=("scene-0002",)))

    made = summarise_checkpoint(tmp_path / "out" / "best.ckpt").adapted
    assert made == {
        "run": str(run),
        "sha256": open_run(run).sha256,
        "source": str(sample_shards),
        "scenes": ("scene-0002",),
        "images": 16,
        "share": 1.0,
    }
    assert summarise_checkpoint(run / "best.ckpt").adapted is None
    known = json.loads((tmp_path / "out" / "splits.json").read_text())
    assert known == splits | {"adapted": ["scene-0002"]}


def test_a_run_is_never_adapted_in_place(make, tmp_path, sample_shards):
    run = make()
    (run / "config.yaml").write_text("system: footprints\n")
    with pytest.raises(OutputError, match="holds a checkpoint already; choose another --out"):
        adapt(run, sample_shards, run)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "a.txt").touch()
    with pytest.raises(OutputError, match="is not empty"):
        adapt(run, sample_shards, tmp_path / "other")


@pytest.mark.parametrize("system", [name for name in CATALOGUE if name not in SEEING])
def test_systems_that_see_no_images_are_refused(make, tmp_path, sample_shards, system):
    with pytest.raises(CheckpointError, match=f"{system} sees no images; there is nothing to adapt"):
        adapt(make(system), sample_shards, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_networks_without_batch_normalisation_are_refused(make, tmp_path, sample_shards, monkeypatch):
    run = make()
    monkeypatch.setattr(module, "batch_norms", lambda network: ())
    with pytest.raises(CheckpointError, match="no batch normalisation; there is nothing to adapt"):
        adapt(run, sample_shards, tmp_path / "out")


@pytest.mark.parametrize(
    ("system", "options", "message"),
    [
        ("oft", {}, "oft needs each camera's calibration; give shards"),
        ("footprints", {"choice": Choice(limit=1)}, "holds no shards, of which scenes, splits or cameras"),
        ("footprints", {}, "statistics of a single image are none"),
    ],
)
def test_folders_of_images_that_do_not_do_are_refused(
    make, tmp_path, sample_shards, system, options, message
):
    images = tmp_path / "images"
    images.mkdir()
    with h5py.File(sample_shards / "scene-0001.h5") as shard:
        (images / "a.jpg").write_bytes(np.asarray(shard["CAM_FRONT/image"][0], np.uint8).tobytes())
    with pytest.raises(SettingsError, match=message):
        adapt(make(system), images, tmp_path / "out", **options)


def test_a_kill_before_the_checkpoint_leaves_a_folder_that_can_be_taken(make, tmp_path, sample_shards):
    run = make()
    adapt(run, sample_shards, tmp_path / "whole", choice=Choice(limit=2))
    shutil.copytree(tmp_path / "whole", tmp_path / "cut")
    (tmp_path / "cut" / "best.ckpt").unlink()
    adapt(run, sample_shards, tmp_path / "cut", choice=Choice(limit=2))
    both = [(tmp_path / name / "best.ckpt").read_bytes() for name in ("whole", "cut")]
    assert both[0] == both[1]
