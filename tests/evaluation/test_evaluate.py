"""Whole evaluations, of runs whose predictions are known."""

import json
import re
import sys
from dataclasses import fields, replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import CheckpointError, OgmkitError, SettingsError
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.formats import report_of
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.grid import GridSpec
from ogmkit.metrics.iou import IOUS
from ogmkit.metrics.separation import PAIR_METRICS
from ogmkit.shards.manifest import read_manifest, write_manifest

TARGETS = ("drivable", "vehicles")


SETTINGS = {field.name for field in fields(EvaluateSettings)}


def scored(shards, runs=(), **options):
    """The evaluation, with settings by their names."""
    settings = {name: options.pop(name) for name in SETTINGS & options.keys()}
    return evaluate(shards, runs, EvaluateSettings(**{"samples": 0, **settings}), **options)


def values(evaluation, system, **wanted):
    """(target, view, region, cells, metric) → value of a system's IoUs."""
    return {
        (one.target, one.view, one.region, one.cells, one.metric): one.value
        for one in evaluation.figures
        if one.system == system
        and one.metric in IOUS
        and all(getattr(one, name) == value for name, value in wanted.items())
    }


def pairs(evaluation, system):
    """Metric → value of a system's neighbouring vehicles."""
    return {
        one.metric: one.value
        for one in evaluation.figures
        if one.system == system and one.metric in PAIR_METRICS
    }


@pytest.fixture
def truth(eval_shards, true_frame):
    """Probabilities that are the truth: of a place."""

    def predict(place):
        drivable, vehicles, _ = true_frame(eval_shards, *place)
        return np.stack([drivable, vehicles]).astype(np.float32), None

    return predict


@pytest.fixture
def noisy(truth):
    """The truth with one cell in five made up, always the same ones of a frame."""

    def predict(place):
        generator = np.random.default_rng(place[2])
        bev, image = truth(place)
        made_up = generator.random(bev.shape) < 0.2
        return np.where(made_up, generator.random(bev.shape), bev).astype(np.float32), image

    return predict


def test_the_truth_scores_one_everywhere(eval_shards, fake_runs, truth):
    found = scored(eval_shards, [fake_runs("run", "oft", truth)])

    assert found.systems == ("oft",)
    bev = values(found, "oft", view="bev")
    assert len(bev) == 24
    assert {one for one in bev.values() if not np.isnan(one)} == {1.0}
    assert sum(np.isnan(one) for one in bev.values()) < 6  # a grid of 70 m has little that is far
    neighbours = pairs(found, "oft")
    assert neighbours["pairs"] == neighbours["pairs_found"] > 0
    assert neighbours["pairs_separated"] == 1.0


def test_a_system_has_28_figures_and_none_in_camera_view_are_values_where_it_predicts_none(
    eval_shards, fake_runs, truth
):
    found = scored(eval_shards, [fake_runs("run", "oft", truth)])

    for system in (*found.systems, *found.fixed):
        assert len(values(found, system)) == 28
        in_view = [*values(found, system, view="camera").values()]
        assert np.isnan(in_view).all() == (system != "mean-mask")
        assert list(pairs(found, system)) == ["pairs", "pairs_found", "pairs_separated"]
    assert {one.definition for one in found.figures} == {"paper"}


def test_figures_are_plain_sums_over_all_frames(eval_shards, fake_runs, noisy, true_frame, both_splits):
    run = fake_runs("run", "oft", noisy)
    found = values(scored(eval_shards, [run], split_file=both_splits, threshold=0.3), "oft")

    # 70 m of 0.5 m cells, the ego on row 136: 50 m ahead is row 36; columns 14 … 53 are within 10 m.
    regions = {region: np.zeros((140, 60), bool) for region in ("full", "close", "far")}
    regions["full"][:] = regions["close"][36:136, 14:54] = regions["far"][:36] = True
    sums = {}
    for entry in read_manifest(eval_shards).shards:
        for camera in ("CAM_FRONT", "CAM_BACK"):
            for index in range(8):
                place = entry.scene, camera, index
                *true, seen = true_frame(eval_shards, *place)
                predicted = noisy(place)[0] > 0.3
                for target, one, other in zip(TARGETS, true, predicted, strict=True):
                    for region, inside in regions.items():
                        for cells, counted in (("all", inside), ("fov", inside & seen)):
                            pairs = ((one & other, one | other), (~one & ~other, ~one | ~other))
                            sums[target, region, cells] = sums.get((target, region, cells), 0) + np.array(
                                [[(part & counted).sum() for part in pair] for pair in pairs]
                            )
    for (target, region, cells), ((hits, union), (background, rest)) in sums.items():
        foreground, other = (a / b if b else np.nan for a, b in ((hits, union), (background, rest)))
        key = target, "bev", region, cells
        np.testing.assert_allclose(found[*key, "foreground_iou"], foreground)
        np.testing.assert_allclose(found[*key, "mean_iou"], (foreground + other) / 2)


def test_all_drivable_is_the_same_from_a_run_and_for_free(eval_shards, fake_runs):
    constant = np.stack([np.ones((140, 60)), np.zeros((140, 60))]).astype(np.float32)
    found = scored(eval_shards, [fake_runs("run", "oft", lambda place: (constant, None))])

    np.testing.assert_equal(values(found, "oft"), values(found, "all-drivable"))


def test_rows_for_free_need_no_run_and_no_torch(eval_shards, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    found = scored(eval_shards)

    assert found.systems == ()
    assert found.fixed == (
        "all-drivable", "mean-map", "mean-mask",
        "ceiling-calibration", "ceiling-surface", "ceiling-full-body",
    )  # fmt: skip
    assert (found.split, found.scenes, found.frames) == ("val", 1, 16)
    assert found.cameras == ("CAM_BACK", "CAM_FRONT")
    assert "no confidence intervals: there is one scene only, and they come from resampling scenes" in (
        found.notes
    )
    assert all(np.isnan([one.low, one.high]).all() for one in found.figures)


def test_intervals_span_the_scenes(eval_shards, fake_runs, noisy, both_splits):
    run = fake_runs("run", "oft", noisy)
    found = scored(eval_shards, [run], split_file=both_splits)

    assert found.scenes == 2
    assert found.fixed[1] == "ceiling-calibration"  # no split to take a mean from
    assert "no mean-map: there is no split 'train' to take it from" in found.notes
    assert not any(note.startswith("no confidence intervals") for note in found.notes)
    numbers = [one for one in found.figures if one.metric in ("pairs", "pairs_found")]
    assert all(np.isnan([one.low, one.high]).all() for one in numbers)
    bev = [
        one for one in found.figures if one.view == "bev" and one not in numbers and not np.isnan(one.value)
    ]
    assert all(one.low <= one.value <= one.high for one in bev)
    assert any(one.low < one.high for one in bev)


def test_counts_by_scene_are_those_of_each_scene_alone(eval_shards, fake_runs, noisy, tmp_path):
    names = [entry.scene for entry in read_manifest(eval_shards).shards]
    run = fake_runs("run", "oft", noisy)

    def counts(*scenes):
        path = tmp_path / "chosen.json"
        path.write_text(json.dumps({"val": scenes}))
        found = scored(eval_shards, [run], split_file=path)
        assert [*found.by_scene] == [*found.systems, *found.fixed]
        return found.by_scene["oft"]

    for turned in (names, names[::-1]):
        both, each = counts(*turned), [counts(name) for name in turned]
        for field in fields(both):
            parts = [getattr(one, field.name) for one in each]
            np.testing.assert_array_equal(getattr(both, field.name), np.concatenate(parts))
        assert (both.bev[0] != both.bev[1]).any()


class TestCameraView:
    """Masks predicted there, at another size than the set's."""

    @pytest.fixture
    def masks(self, eval_shards):
        """The set's own masks, enlarged twice: resized back they are the same."""

        def predict(place):
            scene, camera, index = place
            with h5py.File(eval_shards / f"{scene}.h5", locking=False) as h5:
                group = h5[f"{camera}/footprints/surface"]
                masks = np.stack([group[target][index] for target in TARGETS])
            large = masks.repeat(2, axis=1).repeat(2, axis=2)
            return np.zeros((2, 140, 60), np.float32), large.astype(np.float32)

        return predict

    def test_the_set_itself_scores_one(self, eval_shards, fake_runs, masks):
        run = fake_runs("run", "footprints", masks, masks="surface")
        found = values(scored(eval_shards, [run]), "footprints", view="camera")

        assert found == {(t, "camera", "full", "all", i): 1.0 for t in TARGETS for i in IOUS}

    def test_frames_without_masks_do_not_count(self, own_shards, fake_runs, masks):
        scene = read_manifest(own_shards).split("val")[0].scene
        with h5py.File(own_shards / f"{scene}.h5", "r+") as h5:
            group = h5["CAM_FRONT/footprints/surface"]
            group["valid"][2] = False
            for target in TARGETS:
                group[target][2] = 0
        found = scored(own_shards, [fake_runs("run", "footprints", masks, masks="surface")])

        assert set(values(found, "footprints", view="camera").values()) == {1.0}
        assert found.notes[0].endswith("in camera view; 1 frames have no masks and don't count there")

    def test_a_missing_set_leaves_no_figures_and_names_the_command(self, eval_shards, fake_runs, masks):
        found = scored(eval_shards, [fake_runs("run", "footprints", masks, masks="full-body")])

        assert np.isnan([*values(found, "footprints", view="camera").values()]).all()
        command = f"ogmkit render-footprints {eval_shards} --method full-body"
        assert any("no figures in camera view" in note and command in note for note in found.notes)


def test_the_homography_is_the_networks_where_all_shards_have_it(own_shards, fake_runs):
    run = fake_runs("run", "footprints", masks="surface")
    assert scored(own_shards, [run]).homography == "surface"
    for path in own_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            for camera in h5.values():
                camera.copy("homography/surface", "homography/network")
                camera["homography/network/valid"][:2] = False
    found = scored(own_shards, [run])

    assert found.homography == "network"
    assert "ceiling-network" in found.fixed
    assert "4 of 16 frames have no valid network homography: predicted empty there" in found.notes
    assert scored(own_shards, [run], homography="calibration").homography == "calibration"
    assert [call[0] for call in run.calls] == ["surface", "network", "calibration"]


def test_ceilings_are_those_that_were_chosen(own_shards):
    for path in own_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            for camera in h5.values():
                camera["homography/calibration/valid"][:2] = False
    everything, chosen = scored(own_shards), scored(own_shards, ceilings=["surface"])

    assert chosen.fixed == tuple(name for name in everything.fixed if name != "ceiling-calibration")
    for name in chosen.fixed:
        np.testing.assert_equal(values(chosen, name), values(everything, name))
    assert [note for note in everything.notes if note not in chosen.notes] == [
        "4 of 16 frames have no valid calibration homography: predicted empty there"
    ]
    assert scored(own_shards, ceilings=[]).fixed == (
        "all-drivable", "mean-map", "mean-mask", "ceiling-full-body"
    )  # fmt: skip
    with pytest.raises(SettingsError, match=r"have homography 'dlt' \(all have calibration, surface\)"):
        scored(own_shards, ceilings=["dlt"])


def test_samples_are_spread_and_thresholded(eval_shards, fake_runs, noisy):
    run = fake_runs("run", "oft", noisy)
    found = scored(eval_shards, [run], threshold=0.4, samples=2)

    places = [(one.system, *one.place[1:]) for one in found.samples]
    assert places == [("oft", "CAM_BACK", 4), ("oft", "CAM_FRONT", 4)]
    drivable, vehicles = noisy(found.samples[0].place)[0] > 0.4
    np.testing.assert_array_equal(found.samples[0].bev, drivable + 2 * vehicles)
    assert found.samples[0].image is None


def test_a_limit_may_leave_a_camera_without_a_mean_map(eval_shards):
    found = scored(eval_shards, limit=1)

    assert (found.frames, found.scenes) == (1, 1)
    assert "mean-map" in found.fixed


def test_a_mean_map_of_the_same_scenes_is_told(eval_shards):
    notes = scored(eval_shards, split="train").notes
    assert {f"{name} has seen scenes of this split" for name in ("mean-map", "mean-mask")} <= {*notes}


def masks_of(path, camera):
    """(frames, 2, h, w) masks of the set `surface`, as h5py reads them."""
    with h5py.File(path) as h5:
        group = h5[f"{camera}/footprints/surface"]
        assert group["valid"][:].all()
        return np.stack([group[target][:] for target in TARGETS], axis=1)


@pytest.mark.parametrize("threshold", [0.5, 0.3])
def test_the_mean_mask_is_the_training_scenes_mean_in_camera_view(eval_shards, threshold):
    found = scored(eval_shards, cameras=("CAM_FRONT",), threshold=threshold)

    train, val = (eval_shards / f"{scene}.h5" for scene in ("scene-0001", "scene-0002"))
    predicted = masks_of(train, "CAM_FRONT").mean(axis=0) > threshold
    truth = masks_of(val, "CAM_FRONT") > 0
    both, either = ((truth & predicted).sum((0, 2, 3)), (truth | predicted).sum((0, 2, 3)))
    by_target = values(found, "mean-mask", view="camera", metric="foreground_iou")
    assert [*by_target.values()] == pytest.approx((both / either).tolist())
    assert both[0] > 0


def test_the_mean_mask_is_laid_on_the_grid_as_a_run_s_masks_are(eval_shards, fake_runs):
    """A network that predicts the mean mask, warped pixel by pixel by hand, has the same figures in BEV."""
    mean = masks_of(eval_shards / "scene-0001.h5", "CAM_FRONT").mean(axis=0) > 0.5

    def predict(place):
        with h5py.File(eval_shards / f"{place[0]}.h5", locking=False) as h5:
            image_from_bev = np.linalg.inv(h5["CAM_FRONT/homography/surface/bev_from_image"][place[2]])
        rows, columns = np.mgrid[:140, :60]
        u, v, w = np.moveaxis(np.stack([columns, rows, np.ones_like(rows)], -1) @ image_from_bev.T, -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = np.stack([v / w, u / w]) / 2 - 0.25  # masks have half the image's size
        inside = (w > 0) & (pixels > -0.5).all(0)
        inside &= (pixels[0] < mean.shape[1] - 0.5) & (pixels[1] < mean.shape[2] - 0.5)
        row, column = np.where(inside, np.round(pixels), 0).astype(int)
        return np.where(inside, mean[:, row, column], False).astype(np.float32), None

    found = scored(eval_shards, [fake_runs("run", "oft", predict)], cameras=("CAM_FRONT",))

    mean_mask, by_hand = (values(found, name, view="bev") for name in ("mean-mask", "oft"))
    np.testing.assert_allclose([*mean_mask.values()], [*by_hand.values()], atol=2e-3)
    assert mean_mask["drivable", "bev", "close", "all", "foreground_iou"] > 0.3


def test_a_homography_for_each_mask_gives_each_ones_figures(eval_shards, fake_runs):
    run = fake_runs("run", "footprints", masks="surface")  # the mean mask is of the set that it learns
    pair, surface, calibration = (
        scored(eval_shards, [run], homography=name, cameras=("CAM_FRONT",), ceilings=[])
        for name in ("surface+calibration", "surface", "calibration")
    )
    for name in ("mean-mask", "ceiling-full-body"):
        for target, alone in (("drivable", surface), ("vehicles", calibration)):
            wanted = values(alone, name, target=target, view="bev")
            np.testing.assert_equal(values(pair, name, target=target, view="bev"), wanted)
    assert values(surface, "mean-mask", view="bev") != values(calibration, "mean-mask", view="bev")
    with pytest.raises(SettingsError, match="have homography 'dlt'"):
        scored(eval_shards, homography="surface+dlt")


def test_the_mean_mask_is_of_the_set_that_runs_learn(own_shards, fake_runs):
    for path in own_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            for camera in h5.values():
                camera.copy("footprints/surface", "footprints/own")
                camera.copy("footprints/surface", "footprints/full-body")
    runs = [
        fake_runs("bodies", "footprints", masks="full-body"),
        fake_runs("faces", "footprints", masks="own"),
    ]
    assert (
        "mean-mask: of masks 'own', and compared with them in camera view" in scored(own_shards, runs).notes
    )


def test_without_masks_there_is_no_mean_mask_and_a_note_says_what_makes_them(own_shards):
    for path in own_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            del h5["CAM_BACK/footprints/surface"]
    found = scored(own_shards)

    assert "mean-mask" not in found.fixed
    (note,) = [note for note in found.notes if note.startswith("no mean-mask: ")]
    assert f"`ogmkit render-footprints {own_shards} --method warp --homography surface`" in note


def test_what_the_labels_leave_out_is_named(own_shards):
    manifest = read_manifest(own_shards)
    targets = replace(manifest.settings.targets, min_lidar_points=1)
    write_manifest(own_shards, replace(manifest, settings=replace(manifest.settings, targets=targets)))
    found = scored(own_shards, limit=1)

    assert {one.definition for one in found.figures} == {"paper, min_lidar_points 1"}
    assert report_of(found).heading.startswith("labels: paper, min_lidar_points 1; split val: 1 frame ")


def test_limit_camera_and_progress(eval_shards, fake_runs):
    calls = []
    run = fake_runs("run")
    found = scored(
        eval_shards, [run], cameras=("CAM_BACK",), limit=3, on_progress=lambda *one: calls.append(one)
    )

    assert (found.frames, found.cameras) == (3, ("CAM_BACK",))
    # The run's, the training split's for each of two means, the rows for free.
    assert calls == [(done, 12) for done in range(1, 13)]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"split": "test"}, "unknown split 'test'"),
        ({"threshold": 1.0}, "threshold: 1.0 is not below 1"),
        ({"homography": "dlt"}, "'dlt' (all have calibration, surface); run `ogmkit homography-fit"),
        ({"cameras": ("CAM_FROND",)}, "CAM_FRONT"),
        ({"limit": 0}, "limit: 0 is below 1"),
        ({"scale": 0.0}, "scale: 0.0 is not above 0"),
    ],
)
def test_bad_settings_are_named_in_one_line(eval_shards, settings, message):
    with pytest.raises(OgmkitError, match=re.escape(message)) as caught:
        scored(eval_shards, **settings)
    assert "\n" not in str(caught.value)


def test_an_empty_split_is_named_with_its_file(eval_shards, tmp_path):
    path = tmp_path / "splits.json"
    path.write_text('{"val": ["scene-9999"]}')
    with pytest.raises(SettingsError, match=f"{path}: split 'val' has none of the scenes of {eval_shards}"):
        scored(eval_shards, split_file=path)


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        (
            {"grid": GridSpec(0.5, 140, 60, 136.0, 30.0)},
            SettingsError,
            "grid.ego_column is 30.0 here but 34.0 there",
        ),
        ({"cameras": ("CAM_FRONT",)}, SettingsError, "trained without CAM_BACK; choose --camera CAM_FRONT"),
        (
            {"system": "homography", "output": "homography"},
            CheckpointError,
            "`ogmkit predict homography {shards} --checkpoint {run}`",
        ),
    ],
    ids=["grid", "camera", "no grids"],
)
def test_runs_that_do_not_fit_are_named(eval_shards, fake_runs, options, kind, message):
    run = fake_runs("run", **options)
    with pytest.raises(kind, match=re.escape(message.format(shards=eval_shards, run=run.path))) as caught:
        scored(eval_shards, [run])
    assert str(caught.value).startswith(f"{run.path}: ")


def test_a_run_counts_once(eval_shards, fake_runs):
    one, two = fake_runs("one"), fake_runs("two")
    two.checkpoint = one.checkpoint
    with pytest.raises(SettingsError, match=f"{two.path}: is the same checkpoint as {one.path}"):
        scored(eval_shards, [one, two])


def test_a_run_that_warps_needs_a_homography(own_shards, fake_runs):
    for path in own_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            for camera in h5.values():
                del camera["homography/surface"]
    run = fake_runs("run", "footprints", masks="surface")
    with pytest.raises(
        SettingsError, match="has no homography network or surface; choose --homography calibration"
    ):
        scored(own_shards, [run])
    assert scored(own_shards).fixed == ("all-drivable", "mean-map", "ceiling-calibration")
