"""Fixtures that several folders of tests share; test modules import nothing from each other."""

import hashlib
import importlib.util
import json
import os
import shutil
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import hypothesis
import pytest

FIXTURES = Path(__file__).resolve().parents[1] / "fixtures"
DATA = Path(os.environ.get("OGMKIT_TEST_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
REAL_DATAROOT = DATA / "nuscenes-mini-part"

# A busy machine makes examples slow; no property here is about time.
hypothesis.settings.register_profile("ogmkit", deadline=None, max_examples=50)
hypothesis.settings.load_profile("ogmkit")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Of a test marked `sampled(n)`, n cases run, always the same; the others are slow."""
    cases = defaultdict(list)
    for item in items:
        if item.get_closest_marker("sampled"):
            cases[item.nodeid.partition("[")[0]].append(item)
    for found in cases.values():
        (count,) = found[0].get_closest_marker("sampled").args
        found.sort(key=lambda item: hashlib.sha256(item.nodeid.encode()).digest())
        for item in found[count:]:
            item.add_marker("slow")


@pytest.fixture(scope="session")
def real_dataroot():
    """A part of the real v1.0-mini: scene-0103 (40 key frames, no files), scene-0061 (1, with files)."""
    if not REAL_DATAROOT.is_dir():
        pytest.skip(f"real nuScenes data is absent: {REAL_DATAROOT}")
    return REAL_DATAROOT


@pytest.fixture(scope="session")
def partial_dataroot():
    """Two scenes of the real v1.0-mini; of all but CAM_FRONT only the first three key frames' files."""
    root = DATA / "nuscenes-mini-images"
    if not root.is_dir():
        pytest.skip(f"real nuScenes data is absent: {root}")
    return root


@pytest.fixture(scope="session")
def peer_labels():
    """Labels that the field's repositories gave on those two scenes and on `level_dataroot`."""
    root = DATA / "peer-labels"
    if not root.is_dir():
        pytest.skip(f"labels of the field's repositories are absent: {root}")
    return root


@pytest.fixture(scope="session")
def make_fixtures():
    """The script that makes the dataset in `fixtures/`."""
    spec = importlib.util.spec_from_file_location("make_fixtures", FIXTURES / "make_fixtures.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


@pytest.fixture(scope="session")
def level_dataroot(shared_folder, make_fixtures):
    """The dataset of `fixtures/` as it was when peers' labels were made: level, without images."""
    from ogmkit.synthetic.build import synthesize

    name = "nuscenes-synthetic"
    return shared_folder("level", lambda folder: synthesize(folder / name, make_fixtures.LEVEL)) / name


@pytest.fixture(scope="session")
def tiny_dataroot(shared_folder):
    """A synthetic dataset of two scenes of eight key frames, two small cameras; tests only read it."""
    from ogmkit.synthetic.build import synthesize
    from ogmkit.synthetic.settings import SynthesisSettings

    settings = SynthesisSettings(
        scenes=2, frames=8, cameras=("CAM_FRONT", "CAM_BACK"), image_size=(90, 160), lidar_azimuths=180
    )
    return shared_folder("tiny", lambda folder: synthesize(folder / "dataroot", settings)) / "dataroot"


@pytest.fixture(scope="session")
def extract_all():
    """Extract every scene of a dataset to `folder / "out"`, which is returned: `(root, folder, settings)`."""
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.extract import extract

    def make(root, folder, settings):
        with Dataset(root) as dataset:
            scenes, splits = dataset.scene_names(), dataset.splits()
            extract(
                dataset, folder / "out", settings, scenes=scenes, splits=splits, cache_dir=folder / "cache"
            )
        return folder / "out"

    return make


@pytest.fixture(scope="session")
def make_plan_shards(extract_all):
    """Shards of a few scenes, one camera, an off-centre grid: `make_plan_shards(folder, scenes, frames)`.

    With homographies and footprints by `surface`; of the frames, all but twelve end a sequence.
    """
    from ogmkit.footprints.settings import FootprintSettings
    from ogmkit.grid import GridSpec
    from ogmkit.pipeline.homography_fit import fit_shards
    from ogmkit.pipeline.render_footprints import render_footprints
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.synthetic.build import synthesize
    from ogmkit.synthetic.settings import SynthesisSettings
    from ogmkit.target_settings import TargetSettings

    def make(folder, scenes, frames):
        world, out, cameras = folder / "world", folder / "out", ("CAM_FRONT",)
        synthesize(
            world,
            SynthesisSettings(
                scenes, frames, seed=3, cameras=cameras, image_size=(90, 160), lidar=False, relief_m=1.0
            ),
        )
        settings = ExtractSettings(TargetSettings(GridSpec(0.5, 80, 60, 80.0, 34.0)), cameras)
        extract_all(world, folder, settings)
        fit_shards(out, ("surface",))
        render_footprints(out, FootprintSettings(scale=1.0))
        return out

    return make


@pytest.fixture(scope="session")
def plan_shards(shared_folder, make_plan_shards):
    """Such shards of two scenes (train, val) with four sequences each; tests only read them."""
    return shared_folder("plans", lambda folder: make_plan_shards(folder, 2, 16)) / "out"


@pytest.fixture(scope="session")
def copy_scenes():
    """A folder of scenes, all copies of a folder's first: `copy_scenes(source, out, {scene: (split, log)})`.

    A scene whose log is empty doesn't say which it is of, as shards of earlier versions. Returns `out`.
    """
    import h5py

    from ogmkit.shards.manifest import read_manifest, write_manifest

    def copy(source, out, scenes):
        manifest, entries = read_manifest(source), []
        out.mkdir(parents=True)
        for scene, (split, log) in scenes.items():
            path = out / f"{scene}.h5"
            shutil.copy(source / manifest.shards[0].file, path)
            with h5py.File(path, "r+") as h5:
                h5.attrs["scene"] = scene
                h5.attrs.pop("log", None)
                if log:
                    h5.attrs["log"] = log
            named = {"scene": scene, "file": path.name, "splits": (split,), "bytes": path.stat().st_size}
            entries.append(replace(manifest.shards[0], **named))
        write_manifest(out, replace(manifest, shards=tuple(entries)))
        return out

    return copy


@pytest.fixture(scope="session")
def chromium():
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    return found


@pytest.fixture(scope="session")
def browse(chromium, tmp_path_factory):
    """A browser: `with browse(dark=True) as page`."""
    place = Path(__file__).with_name("report") / "browser.py"
    spec = importlib.util.spec_from_file_location("browser", place)
    module = sys.modules["browser"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda **options: module.Browser(chromium, tmp_path_factory.mktemp("browser"), **options)


@pytest.fixture(scope="session")
def edit_table():
    """Change one JSON table in place: `edit_table(root, table, function)`; returns the table's path.

    The function gets the list of records and changes it, or returns what stands in the file instead.
    """

    def edit(root, table, function):
        (path,) = Path(root).glob(f"v1.0-*/{table}.json")
        records = json.loads(path.read_text(encoding="utf-8"))
        replaced = function(records)
        path.write_text(json.dumps(records if replaced is None else replaced), encoding="utf-8")
        return path

    return edit


@pytest.fixture(scope="session")
def contents():
    """Fingerprints of a folder's files by name: `contents(folder)`."""

    def fingerprints(folder):
        return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}

    return fingerprints


@pytest.fixture(scope="session")
def make_run():
    """Write a RUN with an untrained network: `make_run(path, system, grid, cameras, change, **settings)`.

    `change` gets the network before it is saved. Returns the folder.
    """

    def make(path, system, grid, cameras, change=None, **settings):
        import torch

        from ogmkit.learn.catalogue import CATALOGUE
        from ogmkit.learn.checkpoints import Card, write_checkpoint
        from ogmkit.learn.runs import BEST
        from ogmkit.learn.systems.registry import build_system

        entry = CATALOGUE[system]
        tiny = {
            "image_size": (64, 96),
            "encoder": "tu-test_resnet",
            "channels": 8,
            "blocks": 1,
            "masks": "surface",
        }
        chosen = entry.settings(**entry.read(tiny | settings))
        torch.manual_seed(0)
        net = build_system(chosen, grid, tuple(cameras))
        if change is not None:
            with torch.no_grad():
                change(net)
        path.mkdir(parents=True, exist_ok=True)
        card = Card(chosen, grid, tuple(cameras))
        write_checkpoint(path / BEST, {"state_dict": net.state_dict(), "ogmkit": card.to_dict()})
        return path

    return make


@pytest.fixture(scope="session")
def sample_grid():
    """A small grid, the ego off its middle."""
    from ogmkit.grid import GridSpec

    return GridSpec(0.5, 60, 40, 60.0, 15.0)


@pytest.fixture(scope="session")
def make_sample_shards(extract_all, tiny_dataroot, sample_grid):
    """Shards of the tiny dataset on that grid: `make(folder, **targets)`, in `folder / "out"`."""
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.target_settings import TargetSettings

    def make(folder, **targets):
        settings = ExtractSettings(TargetSettings(sample_grid, **targets), ("CAM_BACK", "CAM_FRONT"))
        return extract_all(tiny_dataroot, folder, settings)

    return make


@pytest.fixture(scope="session")
def sample_shards(shared_folder, make_sample_shards):
    """Two scenes of eight frames, two cameras, images of 90 × 160, masks of 45 × 80.

    Homographies by `calibration` are in all frames, those by `dlt` in some. Tests only read it.
    """
    from ogmkit.footprints.settings import FootprintSettings
    from ogmkit.homography.settings import FitSettings
    from ogmkit.pipeline.homography_fit import fit_shards
    from ogmkit.pipeline.render_footprints import render_footprints

    def fill(folder):
        out = make_sample_shards(folder, lidar=True)
        fit_shards(out, ["surface", "calibration"])
        fit_shards(out, ["dlt"], FitSettings(min_points=12))
        for settings in (
            FootprintSettings("calibration"),
            FootprintSettings("dlt"),
            FootprintSettings("calibration", scale=0.7, name="large"),
        ):
            render_footprints(out, settings)

    return shared_folder("samples", fill) / "out"


FURTHER = {
    "layers": ("drivable_area", "lane_divider"),
    "classes": ("car", "large=bus+truck"),
    "instances": True,
    "flow": True,
    "future": 2,
}


@pytest.fixture(scope="session")
def further_settings():
    """Settings of targets that ask for something of all that lies beside the paper's."""
    return FURTHER


@pytest.fixture(scope="session")
def further_shards(shared_folder, make_sample_shards):
    """The sample shards with that, without homographies and footprints; tests only read them."""
    return shared_folder("further", lambda folder: make_sample_shards(folder, lidar=True, **FURTHER)) / "out"


@pytest.fixture(scope="session")
def surround_shards(shared_folder, extract_all, tiny_dataroot, sample_grid):
    """The tiny dataset with labels round the vehicle beside the paper's. Tests only read it."""
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.target_settings import TargetSettings

    definitions = ("paper", "surround", "lss", "fiery", "cvt", "bevfusion", "pointbev")
    settings = ExtractSettings(
        TargetSettings(sample_grid), ("CAM_BACK", "CAM_FRONT"), definitions=definitions
    )
    return shared_folder("surround", lambda folder: extract_all(tiny_dataroot, folder, settings)) / "out"


@pytest.fixture(scope="session")
def seen_shards(shared_folder, make_sample_shards):
    """The tiny dataset with all masks of cells that are seen. Tests only read it."""
    return shared_folder("seen", lambda folder: make_sample_shards(folder, seen=("rays", "lidar"))) / "out"


@pytest.fixture
def copied_shards(sample_shards, tmp_path):
    """A copy of the sample shards, to be changed."""
    return shutil.copytree(sample_shards, tmp_path / "out")
