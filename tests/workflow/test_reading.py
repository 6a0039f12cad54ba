"""The file of a run, as a configuration."""

from pathlib import Path

import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import SettingsError
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.workflow.reading import config_of
from ogmkit.workflow.steps import Call

FILE = Path("folder/chain.yaml")
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def config(**values):
    return config_of({"data": "../world", "out": "out", **values}, FILE)


def test_paths_are_relative_to_the_file():
    found = config(split_file="a.json")
    assert (found.source.data, found.out) == (Path("world"), Path("folder/out"))
    assert found.source.split_file == Path("folder/a.json")
    assert (found.shards, found.run_folder("x")) == (Path("folder/out/shards"), Path("folder/out/runs/x"))
    assert config_of({"data": "/d", "out": "/o"}, FILE).out == Path("/o")


def test_paths_may_begin_with_a_tilde(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "resnet.pt").touch()
    (tmp_path / "run").mkdir()
    found = config(
        data="~/nuscenes",
        out="~/out",
        split_file="~/a.json",
        train={"encoder_weights": "~/resnet.pt"},
        homography={},
        planners=[{"system": "holistic", "perception": "~/run"}],
    )
    assert (found.source.data, found.out) == (tmp_path / "nuscenes", tmp_path / "out")
    assert found.source.split_file == tmp_path / "a.json"
    assert found.homography.settings.encoder_weights == str(tmp_path / "resnet.pt")
    assert found.planners[0].settings.perception == str(tmp_path / "run")


def test_sizes_are_height_and_width():
    assert config(homography={"image_size": [64, 96]}).homography.settings.image_size == (64, 96)


def test_workers_of_0_and_1_are_this_process():
    assert [config(workers=number).workers for number in (0, 1, 2)] == [1, 1, 2]


def test_alone_it_makes_shards_and_homographies():
    found = config()
    assert found.trainings == ()
    assert found.homographies == ("surface", "dlt", "plane", "calibration")
    assert (found.evaluate.split, found.evaluate.homography) == (None, "surface")
    assert (found.extract.cameras, found.workers, found.readers, found.masks.scale) == (
        ("CAM_FRONT",),
        1,
        0,
        2.0,
    )


def test_the_steps_on_shards_go_to_the_scheduler(monkeypatch):
    pytest.importorskip("distributed", reason="distributed is not installed: pip install 'ogmkit[cluster]'")
    chosen = config(scheduler="tcp://10.0.0.7:8786", workers=3)
    execution = Call(overwrite=True, let_go=int, advance=max).execution(chosen)
    assert execution == Execution(3, "tcp://10.0.0.7:8786", overwrite=True, on_progress=max)
    assert config().scheduler == ""
    assert config_of(chosen.to_dict(), FILE).scheduler == chosen.scheduler


def test_how_many_trainings_go_on_at_once_stands_in_the_file():
    chosen = config(trainings_at_once=4)
    assert (chosen.trainings_at_once, config().trainings_at_once) == (4, 1)
    assert config_of(chosen.to_dict(), FILE).trainings_at_once == 4


def test_a_grid_keeps_the_ego_at_the_bottom_and_six_elevenths_of_the_width():
    assert config(extract={"grid": {"m_per_cell": 0.5, "rows": 80, "columns": 55}}).extract.targets.grid == (
        GridSpec(0.5, 80, 55, 80.0, 30.0)
    )
    assert config(extract={"grid": {"ego_row": 900}}).extract.targets.grid == GridSpec(ego_row=900.0)


def test_settings_of_all_trainings_yield_to_those_of_one():
    found = config(
        train={"lr": 0.5, "epochs": 3, "workers": 0},
        workers=4,
        homography=None,
        footprints={"epochs": 7, "workers": 2},
        planners=["lstm-ed", {"system": "mid-to-end", "no_past": True, "lr": "1e-2"}],
    )
    shown = [(one.name, one.settings.epochs, one.settings.lr) for one in found.trainings]
    assert shown == [
        ("homography", 3, 0.5),
        ("footprints", 7, 0.5),
        ("lstm-ed", 3, 0.5),
        ("mid-to-end-np", 3, 0.01),
    ]
    assert [one.settings.workers for one in found.trainings] == [0, 2, 0, 0]
    assert [one.settings.workers for one in config(workers=4, planners=["lstm-ed"]).trainings] == [4]
    assert [one.settings.workers for one in config(planners=["lstm-ed"]).trainings] == [0]


def test_trainings_are_named_by_what_they_do_without():
    without = {"system": "mid-to-end", "no_destination": True}
    found = config(planners=["mid-to-end", without, {**without, "no_past": True}])
    assert [one.name for one in found.trainings] == ["mid-to-end", "mid-to-end-nd", "mid-to-end-np-nd"]


def test_shared_settings_go_to_the_trainings_that_read_them():
    found = config(
        train={"hidden": 64, "image_size": [64, 96]},
        homography={},
        planners=["lstm-ed", "end-to-end"],
    )
    homography, lstm, end = (one.settings for one in found.trainings)
    assert (lstm.hidden, end.hidden) == (64, 64)
    assert (homography.image_size, end.image_size) == ((64, 96), (64, 96))
    assert found.notes == ()


def test_shared_settings_that_no_training_reads_give_one_note():
    found = config(train={"kl_weight": 2, "blocks": 3, "lr": 0.5}, planners=["lstm-ed"])
    assert found.notes == (f"{FILE}: train: no training here reads kl_weight, blocks; ignored",)
    assert found.trainings == config(train={"lr": 0.5}, planners=["lstm-ed"]).trainings


def test_everything_builds_on_the_network_if_there_is_one():
    planners = ["holistic", "lstm-ed"]
    with_network = config(homography={}, footprints={}, planners=planners)
    holistic, lstm = (one.settings for one in with_network.planners)
    assert with_network.footprints.settings.masks == "network"
    assert (holistic.masks, holistic.warp, holistic.perception) == ("network", "network", "footprints")
    assert lstm.masks_learnt is None
    assert with_network.evaluate.homography == "network"
    without = config(footprints={}, planners=planners)
    assert without.footprints.settings.masks == "surface"
    assert (without.planners[0].settings.masks, without.planners[0].settings.warp) == ("surface", "surface")
    assert config(planners=planners).planners[0].settings.perception is None


def test_what_the_file_says_of_a_holistic_planner_holds(tmp_path):
    found = config(
        footprints={},
        baselines=[{"system": "footprints", "masks": "full-body"}],
        planners=[
            {"system": "holistic", "name": "fresh", "perception": None},
            {
                "system": "holistic",
                "name": "bodies",
                "perception": "footprints-full-body",
                "masks": "full-body",
            },
            {"system": "holistic", "name": "foreign", "perception": str(tmp_path)},
        ],
    )
    assert [one.settings.perception for one in found.planners] == [
        None,
        "footprints-full-body",
        str(tmp_path.resolve()),
    ]


def test_weights_are_a_file_beside_this_one_or_a_name(tmp_path):
    (tmp_path / "resnet.pt").touch()
    values = {"data": "d", "out": "o", "planners": [{"system": "end-to-end", "encoder_weights": "resnet.pt"}]}
    (training,) = config_of(values, tmp_path / "chain.yaml").planners
    assert training.settings.encoder_weights == str(tmp_path / "resnet.pt")
    (training,) = config(planners=[{"system": "end-to-end", "encoder_weights": "imagenet"}]).planners
    assert training.settings.encoder_weights == "imagenet"


def test_sets_of_masks_are_made_by_what_their_names_say():
    found = config(render_footprints={"scale": 3}, homography={})
    assert found.footprint_set("network") == FootprintSettings("network", "warp", 3.0)
    assert found.footprint_set("surface-project") == FootprintSettings("surface", "project", 3.0)
    assert found.footprint_set("full-body").set_name == "full-body"
    for name in ("network", "network-project"):
        assert found.footprint_set(name).set_name == name


@pytest.mark.parametrize("name", ["demo.yaml", "nuscenes.yaml", "nuscenes-mini.yaml"])
def test_the_examples_say_the_same_again_when_written_out(name):
    yaml = pytest.importorskip("yaml", reason="yaml is not installed: pip install 'ogmkit[train]'")
    path = EXAMPLES / name
    first = config_of(yaml.safe_load(path.read_text(encoding="utf-8")), path)
    written = yaml.safe_load(yaml.safe_dump(first.to_dict()))
    again = config_of(written, Path("/elsewhere/config.yaml"))
    assert again.to_dict() == first.to_dict()
    assert (again.trainings, again.evaluate) == (first.trainings, first.evaluate)
    assert again.extract.to_dict() == first.extract.to_dict()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"extrat": {}}, "unknown setting 'extrat'; did you mean extract?"),
        ({"out": None}, "out: say which folder"),
        ({"extract": {"lidr": True}}, "extract: unknown setting 'lidr'; did you mean lidar?"),
        ({"extract": {"grid": {"row": 3}}}, "extract: grid: unknown setting 'row'; did you mean row"),
        ({"extract": {"grid": {"rows": 0}}}, "extract: grid: rows: 0 is below 1"),
        ({"cameras": []}, "extract: cameras: none"),
        ({"workers": -1}, "workers: -1 is below 0"),
        ({"trainings_at_once": 0}, "chain.yaml: trainings_at_once: 0 is below 1"),
        ({"trainings_at_once": "all"}, "chain.yaml: trainings_at_once: "),
        ({"scheduler": "10.0.0.7"}, "chain.yaml: scheduler: scheduler '10.0.0.7': give local, or an address"),
        ({"train": {"image_size": "64x96"}, "homography": {}}, "image_size: '64x96' is not a list"),
        ({"homography_fit": {"methods": []}}, "homography_fit: methods: name at least one"),
        ({"homography_fit": {"methods": ["dtl"]}}, "methods: unknown method 'dtl'; did you mean dlt?"),
        ({"homography_fit": {"min_points": 3}}, "homography_fit: min_points: 3 is below 4"),
        ({"render_footprints": {"name": "x"}}, "render_footprints: unknown setting 'name'"),
        (
            {"render_footprints": {"scale": 0, "sets": ["surface"]}},
            "render_footprints: sets: scale: 0.0 is not above 0",
        ),
        ({"render_footprints": {"sets": ["network"]}}, "sets: nothing makes the masks 'network'"),
        ({"train": {"epoch": 3}}, "train: unknown setting 'epoch'; did you mean epochs?"),
        ({"homography": {"lr": "quick"}}, "homography: lr: 'quick' is not a number"),
        ({"homography": {"epochs": 0}}, "homography: epochs: 0 is below 1"),
        ({"homography": {"system": "ved"}}, "homography: unknown setting 'system'"),
        (
            {"homography": {"target": "robust"}},
            "target: nothing makes homographies 'robust'; there are: surf",
        ),
        (
            {"footprints": {"kl_weight": 2}},
            "footprints: kl_weight: footprints does not read it; ved does",
        ),
        ({"footprints": {"masks": "robust"}}, "footprints: masks: nothing makes the masks 'robust'"),
        (
            {"train": {"devices": 2}, "footprints": {}},
            "train: devices: a chain trains each network on one GPU",
        ),
        ({"footprints": {"split_ratio": [7, 1]}}, "footprints: split_ratio: give a split_file"),
        ({"baselines": "ved"}, "baselines: not a list of systems"),
        ({"baselines": ["lstm-ed"]}, "baselines: 1: unknown system 'lstm-ed'"),
        ({"baselines": ["ved", 3]}, "baselines: 2: not a mapping"),
        ({"baselines": ["bev-lidar"]}, "bev-lidar needs `lidar: true` under extract"),
        ({"planners": ["lstm-ed", "lstm-ed"]}, "two trainings are called lstm-ed"),
        ({"planners": [{"system": "lstm-ed", "name": "../x"}]}, "name '../x': use letters"),
        (
            {"planners": [{"system": "lstm-ed", "no_past": True}]},
            "no_past: lstm-ed does not read it; end-to-end, mid-to-end, holistic, holistic-cv do",
        ),
        ({"planners": [{"system": "holistic", "perception": "foot"}]}, "'foot' is neither a training"),
        ({"planners": [{"system": "holistic", "warp": "network"}]}, "warp: nothing makes homographies 'net"),
        (
            {"footprints": {"encoder": "resnet18"}, "planners": ["holistic"]},
            "encoder: resnet101 can't begin with footprints, which has resnet18",
        ),
        (
            {"footprints": {"decoder_width": 48}, "planners": ["holistic"]},
            "decoder_width: 256 can't begin with footprints, which has 48",
        ),
        ({"evaluate": {"threshold": 1}}, "evaluate: threshold: 1.0 is not below 1"),
        ({"evaluate": {"scale": 0}}, "evaluate: scale: 0.0 is not above 0"),
        ({"evaluate": {"limit": 0}}, "evaluate: limit: 0 is below 1"),
        ({"evaluate": {"homography": "network"}}, "homography: nothing makes 'network'; there are: surface"),
    ],
)
def test_what_is_wrong_is_named_with_file_and_place(values, message):
    with pytest.raises(SettingsError) as caught:
        config(**values)
    assert str(caught.value).startswith(f"{FILE}: ")
    assert message in str(caught.value)
