import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, DataFileError, SettingsError, TableError
from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.plans.folder import plan_of_images
from ogmkit.learn.predict.plans.objects import PlanJob
from ogmkit.learn.predict.plans.shards import plans_of_shards
from ogmkit.learn.predict.run import open_run
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.reader import Shard

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
CAMERAS = ("CAM_FRONT",)
SYSTEMS = {
    "lstm-ed": {},
    "end-to-end": {},
    "mid-to-end": {},
    "holistic": {"warp": "surface"},
    "holistic-cv": {},
}
SCENE, FRAME = "scene-0001", 7


def sharpen(net):
    """Untrained, all images look alike: let what a planner sees weigh in its plan."""
    if hasattr(net, "perception"):
        for head in net.perception.heads:
            head.weight.mul_(300.0)
    if net.planner.embed_features is not None:
        net.planner.embed_features[0].weight.mul_(10.0)


@pytest.fixture(scope="module")
def runs(tmp_path_factory, make_run):
    """System → RUN; `end-to-end-np` and `lstm-ed-nd` too."""
    folder = tmp_path_factory.mktemp("runs")
    systems = {**SYSTEMS, "end-to-end-np": {"no_past": True}, "lstm-ed-nd": {"no_destination": True}}
    return {
        name: make_run(folder / name, re.sub("-n[pd]$", "", name), GRID, CAMERAS, sharpen, **more)
        for name, more in systems.items()
    }


@pytest.fixture(scope="module")
def geometry(plan_shards):
    """Of the six images up to one of the first scene, dataset → values."""
    names = (
        "level_from_global",
        "global_from_ego",
        "ego_from_camera",
        "intrinsics",
        "image_size",
        "trajectory/future",
        "homography/surface/bev_from_image",
    )
    with Shard(plan_shards / f"{SCENE}.h5") as shard:
        return {name: shard.dataset("CAM_FRONT", name)[FRAME - 5 : FRAME + 1] for name in names}


@pytest.fixture(scope="module")
def images(tmp_path_factory, plan_shards):
    """Those six images, as a folder."""
    folder = tmp_path_factory.mktemp("images")
    with Shard(plan_shards / f"{SCENE}.h5") as shard:
        for place in range(6):
            (folder / f"{place}.jpg").write_bytes(shard.image("CAM_FRONT", FRAME - 5 + place).tobytes())
    return folder


@pytest.fixture
def known(geometry):
    """What the plan's file says of them."""
    # The ego's positions seen from its last pose, by hand: shifted, then turned by its heading.
    poses = geometry["global_from_ego"]
    heading = np.arctan2(poses[-1, 1, 0], poses[-1, 0, 0])
    ahead, left = (np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))
    positions = (poses[:, :2, 3] - poses[-1, :2, 3]) @ np.array([ahead, left]).T
    return {
        "image_size": geometry["image_size"][0].tolist(),
        "bev_from_image": geometry["homography/surface/bev_from_image"].tolist(),
        "positions": positions.tolist(),
        "destination": geometry["trajectory/future"][-1, 5].tolist(),
    }


@pytest.fixture
def plan(tmp_path, images):
    """Plan from the six images: `plan(run, values)`; returns the object."""

    def plan(run, values, folder=images, samples=0, **more):
        path = tmp_path / "plan.json"
        path.write_text(values if isinstance(values, str) else json.dumps(values))
        stream = plan_of_images(PlanJob(run, samples), folder, path, **more)
        (one,) = stream.objects
        assert stream.count == 1
        return one

    return plan


def means(one):
    return np.array([[point["x"], point["y"]] for point in one["plan"]])


def numbers(one):
    return np.array([list(point.values()) for point in one["plan"]])


def test_images_that_are_counted_come_in_the_order_of_their_numbers(tmp_path, runs, known, plan, images):
    folder = tmp_path / "counted"
    folder.mkdir()
    for place in range(6):
        shutil.copy(images / f"{place}.jpg", folder / f"run2_{8 + place}.jpg")
    one = plan(runs["end-to-end"], known, folder)
    assert one["files"] == [f"run2_{number}.jpg" for number in range(8, 14)]
    assert numbers(one).tolist() == numbers(plan(runs["end-to-end"], known)).tolist()


@pytest.mark.parametrize("system", ["lstm-ed", "end-to-end", "end-to-end-np", "holistic", "holistic-cv"])
def test_six_images_are_planned_from_as_those_of_shards(plan_shards, runs, known, plan, system):
    choice = Choice((SCENE,))
    expected = next(
        one
        for one in plans_of_shards(PlanJob(runs[system], samples=2), plan_shards, choice=choice).objects
        if one["frame"] == FRAME
    )
    one = plan(runs[system], known, samples=2)
    np.testing.assert_allclose(numbers(one), numbers(expected), atol=2e-4)
    assert one["destination"] == expected["destination"]
    assert np.shape(one["samples"]) == (2, 5, 2)
    seen = system != "lstm-ed"
    assert one["files"] == ([f"{place}.jpg" for place in range(6)] if seen else [])
    assert one.get("homography_valid") == ([True] * 6 if system == "holistic" else None)


@pytest.mark.parametrize("system", ["end-to-end-np", "holistic", "holistic-cv"])
def test_images_go_in_oldest_first(tmp_path, runs, images, known, plan, system):
    turned = tmp_path / "turned"
    turned.mkdir()
    for place in range(6):
        shutil.copy(images / f"{5 - place}.jpg", turned / f"{place}.jpg")
    apart = np.abs(means(plan(runs[system], known, folder=turned)) - means(plan(runs[system], known)))
    assert apart.max() > 1e-3  # or the order of the others could be wrong unseen


def test_a_calibrated_camera_leads_to_the_plane_below_the_ego(runs, geometry, known, plan):
    level_from_camera = (
        geometry["level_from_global"] @ geometry["global_from_ego"] @ geometry["ego_from_camera"]
    )
    pairs = zip(geometry["intrinsics"], level_from_camera, strict=True)
    flat = [GRID.bev_from_level @ np.linalg.inv(image_from_ground(*pair)) for pair in pairs]
    expected = plan(runs["holistic"], known | {"bev_from_image": np.array(flat).tolist()})
    assert np.abs(numbers(expected) - numbers(plan(runs["holistic"], known))).max() > 1e-3
    del known["bev_from_image"]
    known |= {
        "intrinsics": geometry["intrinsics"][0].tolist(),  # one for all
        "level_from_camera": level_from_camera.tolist(),
    }
    np.testing.assert_allclose(numbers(plan(runs["holistic"], known)), numbers(expected), atol=1e-5)


def test_one_matrix_stands_for_six(runs, known, plan):
    one = known["bev_from_image"][2]
    alone, six = (plan(runs["holistic"], known | {"bev_from_image": value}) for value in (one, [one] * 6))
    np.testing.assert_array_equal(numbers(alone), numbers(six))
    assert np.abs(numbers(alone) - numbers(plan(runs["holistic"], known))).max() > 1e-3


def test_a_network_s_homographies_lead_to_the_plane(
    tmp_path, plan_shards, runs, geometry, known, plan, make_run
):
    def change(net):
        matrices = torch.from_numpy(geometry["homography/surface/bev_from_image"]) @ torch.diag(
            torch.tensor([160 / 96, 90 / 64, 1.0], dtype=torch.float64)
        )
        fitted = type(net.code).fit(
            matrices, torch.zeros(6, dtype=torch.int64), 1, net.settings.image_size, GRID
        )
        net.code.load_state_dict(fitted.state_dict())
        torch.nn.init.normal_(net.net.layers[-1].weight, std=1.0)

    network = make_run(tmp_path / "homography", "homography", GRID, CAMERAS, change)
    index = index_frames(plan_shards, [SCENE], CAMERAS, needs=SampleSpec(), valid_only=False)
    frames = list(open_run(network).frames(index, None, batch_size=8, workers=0))
    matrices = [frame.bev_from_image.tolist() for frame in frames[FRAME - 5 : FRAME + 1]]
    assert np.isfinite(matrices).all()
    expected = plan(runs["holistic"], known | {"bev_from_image": matrices})
    assert np.abs(numbers(expected) - numbers(plan(runs["holistic"], known))).max() > 1e-3
    del known["bev_from_image"]
    one = plan(runs["holistic"], known, homography_checkpoint=network)
    np.testing.assert_allclose(numbers(one), numbers(expected), atol=2e-4)
    assert one["homography_valid"] == [True] * 6


def test_the_past_is_not_needed_where_it_is_not_seen(runs, known, plan):
    expected = plan(runs["end-to-end-np"], known)
    del known["positions"]
    np.testing.assert_array_equal(numbers(plan(runs["end-to-end-np"], known)), numbers(expected))
    with pytest.raises(TableError, match=r"plan\.json: positions is missing; add it"):
        plan(runs["end-to-end"], known)


def test_a_planner_that_is_not_told_the_destination_needs_none(plan_shards, runs, known, plan):
    one = plan(runs["lstm-ed-nd"], {"positions": known["positions"]}, samples=2)
    stream = plans_of_shards(PlanJob(runs["lstm-ed-nd"], samples=2), plan_shards, choice=Choice((SCENE,)))
    expected = next(other for other in stream.objects if other["frame"] == FRAME)
    np.testing.assert_allclose(numbers(one), numbers(expected), atol=2e-4)
    assert stream.name == "lstm-ed-nd"
    assert [point["t_s"] for point in one["plan"]] == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert np.shape(one["samples"]) == (2, 6, 2)
    assert not {"destination"} & (one.keys() | expected.keys())
    np.testing.assert_array_equal(numbers(plan(runs["lstm-ed-nd"], known)), numbers(one))


def test_a_planner_that_sees_no_image_needs_none(tmp_path, runs, known, plan):
    (tmp_path / "empty").mkdir()
    values = {name: known[name] for name in ("positions", "destination")}
    one = plan(runs["lstm-ed"], values, folder=tmp_path / "empty")
    np.testing.assert_array_equal(numbers(one), numbers(plan(runs["lstm-ed"], known)))


def replaced(key, value):
    return lambda known: known | {key: value}


def moved(place, value):
    def change(known):
        positions = [list(point) for point in known["positions"]]
        positions[place] = value
        return known | {"positions": positions}

    return change


UP = [[0, 0, 1, 1.5], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda known: known.pop("destination") and known, "destination is missing; add it"),
        (replaced("destination", [0, 0.0]), "destination is the origin, which has no direction; for a car"),
        (replaced("destination", [float("nan"), 1]), "destination holds a number that is not finite"),
        (replaced("destination", [1e7, 1]), "destination holds a number over 1e\\+06 m; give metres in"),
        (replaced("destination", [1, 2, 3]), r"destination is not \[x, y\] in metres"),
        (replaced("destination", ["1", 2]), r"destination is not \[x, y\] in metres"),
        (replaced("destination", None), r"destination is not \[x, y\] in metres"),
        (moved(2, [1, float("nan")]), "positions holds a number that is not finite"),
        (moved(2, [1, None]), "positions is not 6 rows of 2 numbers"),
        (moved(2, ["x", 1]), "positions is not 6 rows of 2 numbers"),
        (moved(2, [10**400, 1]), "positions holds a number that is too large"),
        (moved(0, [1e7, 1]), "positions holds a number over 1e\\+06 m"),
        (
            moved(5, [0.5, -1]),
            r"positions ends at \(0.5, -1\), not \(0, 0\): give metres in the last image's",
        ),
        (replaced("positions", [[0, 0]] * 5), "positions is not 6 rows of 2 numbers"),
        (lambda known: known.pop("image_size") and known, "image_size is missing; add it"),
        (replaced("image_size", [90]), r"image_size is not \[height, width\]"),
        (replaced("image_siz", [90, 160]), "unknown key 'image_siz'; did you mean image_size"),
        (replaced("level_from_lidar", UP), "unknown key 'level_from_lidar'"),
        (replaced("camera", "CAM_TOP"), "unknown camera 'CAM_TOP'"),
        (
            replaced("bev_from_image", [np.eye(3).tolist()] * 5),
            "bev_from_image holds 5 matrices, not one or 6",
        ),
        (replaced("bev_from_image", [[1, 2], [3, 4]]), "bev_from_image is not 3 rows of 3 numbers"),
        (
            lambda known: known | {"bev_from_image": [*known["bev_from_image"][:5], UP]},
            "bev_from_image, matrix 6, is not 3 rows of 3 numbers",
        ),
        (
            lambda known: known
            | {"bev_from_image": [*known["bev_from_image"][:5], np.zeros((3, 3)).tolist()]},
            "image 6 of 6: leads to no homography: .*singular",
        ),
        (
            lambda known: {key: value for key, value in known.items() if key != "bev_from_image"},
            "image 1 of 6: gives neither bev_from_image nor intrinsics",
        ),
    ],
)
def test_a_wrong_file_is_named_with_its_key(tmp_path, runs, known, plan, change, message):
    with pytest.raises(TableError, match=message) as error:
        plan(runs["holistic"], change(known))
    assert str(error.value).startswith(f"{tmp_path}/plan.json: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "not JSON"), ("[]", "holds no object with camera"), ("{}", "holds no object")],
)
def test_a_file_that_holds_no_object_is_named(runs, plan, text, message):
    with pytest.raises(TableError, match=f"plan.json: {message}"):
        plan(runs["lstm-ed"], text)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda folder: (folder / "3.jpg").unlink(), "images: holds 5 images; a plan takes 6, 0.5 s apart"),
        (lambda folder: shutil.copy(folder / "0.jpg", folder / "6.jpg"), "images: holds 7 images"),
        (lambda folder: [path.unlink() for path in folder.iterdir()], r"images: holds no \*.jpg"),
        (lambda folder: (folder / "2.jpg").write_bytes(b"\xff\xd8"), "2.jpg: not a whole JPEG or PNG"),
        (
            lambda folder: cv2.imwrite(str(folder / "2.jpg"), np.zeros((80, 160, 3), np.uint8)),
            "2.jpg: has 160 × 80 pixels, by its calibration 160 × 90; correct image_size",
        ),
    ],
)
def test_wrong_images_are_named(tmp_path, runs, images, known, plan, change, message):
    folder = shutil.copytree(images, tmp_path / "images")
    change(folder)
    with pytest.raises(DataFileError, match=message):
        plan(runs["end-to-end"], known, folder=folder)


def test_wrong_runs_are_named(tmp_path, runs, known, plan, make_run):
    cameras = ("CAM_BACK", "CAM_FRONT")
    several = make_run(tmp_path / "several", "homography", GRID, cameras)
    coarse = make_run(tmp_path / "coarse", "homography", GridSpec(1.0, 40, 30, 40.0, 17.0), CAMERAS)
    back = make_run(tmp_path / "back", "homography", GRID, ("CAM_BACK",))
    front = known | {"camera": "CAM_FRONT"}
    for run, network, values, error, message in (
        (
            runs["mid-to-end"],
            None,
            known,
            CheckpointError,
            "mid-to-end plans from true masks.* plan from shards",
        ),
        (several, None, known, CheckpointError, "is a run of homography, which plans nothing"),
        (runs["lstm-ed"], several, known, SettingsError, "warps nothing; leave out --homography-checkpoint"),
        (runs["holistic"], runs["lstm-ed"], known, CheckpointError, "is a run of lstm-ed, not of homography"),
        (runs["holistic"], coarse, known, SettingsError, "was trained on another grid than"),
        (runs["holistic"], several, known, TableError, "camera is missing; name one of CAM_BACK, CAM_FRONT"),
        (runs["holistic"], back, front, TableError, "unknown camera 'CAM_FRONT'"),
    ):
        more = {} if network is None else {"homography_checkpoint": network}
        with pytest.raises(error, match=message):
            plan(run, values, **more)


def test_a_network_that_gives_no_numbers_is_refused(tmp_path, images, known, plan, make_run):
    run = make_run(
        tmp_path / "run", "lstm-ed", GRID, CAMERAS, lambda net: next(net.parameters()).fill_(torch.nan)
    )
    with pytest.raises(CheckpointError, match=rf"best.ckpt: its plan for {images} is not finite"):
        plan(run, known)


def test_the_documented_file_leads_to_a_plan(tmp_path, runs, plan):
    text = (Path(__file__).parents[4] / "docs" / "predict.md").read_text(encoding="utf-8")
    section = re.search(r"^## Plans\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    (example,) = re.findall(r"^```json\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    images = tmp_path / "images"
    images.mkdir()
    for place in range(6):
        cv2.imwrite(str(images / f"{place}.png"), np.zeros((900, 1600, 3), np.uint8))
    assert plan(runs["holistic"], example, folder=images)["homography_valid"] == [True] * 6
