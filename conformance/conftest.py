"""Datasets that both the official devkit and ogmkit read, in an environment that holds both."""

import os
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import pytest
from nuscenes.nuscenes import NuScenes

from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

DATA = Path(os.environ.get("OGMKIT_TEST_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
REAL = DATA / "nuscenes-mini-part"
VERSION = "v1.0-mini"

mpl.use("Agg")


def pytest_configure(config):
    """The devkit's own warnings are not this project's: show them, don't fail."""
    config.addinivalue_line("filterwarnings", "default")


CAMERAS = ("CAM_FRONT", "CAM_FRONT_RIGHT", "CAM_BACK_RIGHT", "CAM_BACK", "CAM_BACK_LEFT", "CAM_FRONT_LEFT")
TWO = ("CAM_FRONT", "CAM_BACK_RIGHT")
THREE = (*TWO, "CAM_FRONT_LEFT")


@dataclass(frozen=True)
class World:
    """One dataset, as the devkit sees it."""

    root: Path
    nusc: NuScenes
    cameras: tuple[str, ...] = CAMERAS

    @classmethod
    def load(cls, root, *cameras):
        return cls(root, NuScenes(VERSION, str(root), verbose=False), cameras or CAMERAS)


@pytest.fixture(scope="session")
def real_dataroot():
    if not REAL.is_dir():
        pytest.skip(f"no real nuScenes data at {REAL}")
    return REAL


@pytest.fixture(scope="session")
def real_world(real_dataroot):
    return World.load(real_dataroot)


@pytest.fixture(scope="session")
def flat_world(synthesized):
    """Of few cameras: to draw six takes most of the tests' time."""
    return World.load(synthesized("flat", relief_m=0.0, seed=5, cameras=TWO), *TWO)


@pytest.fixture(scope="session")
def hilly_world(synthesized):
    return World.load(synthesized("hilly", relief_m=4.0, seed=6, cameras=THREE), *THREE)


@pytest.fixture(scope="session")
def synthesized(shared_folder):
    """Two scenes, so two maps; enough key frames for whole trajectories."""

    def make(name, **settings):
        wanted = SynthesisSettings(
            scenes=2, frames=14, version=VERSION, image_size=(225, 400), lidar_azimuths=200, **settings
        )
        return shared_folder(name, lambda folder: synthesize(folder / "dataset", wanted)) / "dataset"

    return make


# test_extract.py begins with the flat one, in another process.
@pytest.fixture(scope="session", params=["hilly_world", "flat_world"])
def synthetic_world(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="session")
def cache_dir(tmp_path_factory):
    return tmp_path_factory.mktemp("masks")
