"""Tests of the networks need the extra `train`; where it is absent, the folder is skipped and says so."""

import importlib.util
from pathlib import Path

import pytest

HERE = Path(__file__).parent

if importlib.util.find_spec("torch") is None:

    @pytest.fixture(autouse=True)
    def _no_torch():
        pytest.skip("torch is not installed: pip install 'ogmkit[train]'")

    class _Unimported(pytest.Module):
        """A module whose import would fail: reported as one skipped test."""

        def collect(self):
            pytest.skip("torch is not installed: pip install 'ogmkit[train]'", allow_module_level=True)

    def pytest_pycollect_makemodule(module_path, parent):
        return _Unimported.from_parent(parent, path=module_path)

else:
    import torch

    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def learn_shards(shared_folder, extract_all, tiny_dataroot):
    """Two scenes (train, val) of two cameras on an off-centre grid, with LiDAR, homographies and footprints.

    Tests only read it.
    """
    from ogmkit.footprints.settings import FootprintSettings
    from ogmkit.grid import GridSpec
    from ogmkit.pipeline.homography_fit import fit_shards
    from ogmkit.pipeline.render_footprints import render_footprints
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.target_settings import TargetSettings

    grid = GridSpec(0.5, 80, 60, 80.0, 34.0)
    settings = ExtractSettings(TargetSettings(grid, lidar=True), ("CAM_FRONT", "CAM_BACK"))

    def fill(folder):
        out = extract_all(tiny_dataroot, folder, settings)
        fit_shards(out, ("surface", "calibration"))
        for method in ("warp", "full-body"):
            render_footprints(out, FootprintSettings(method=method, scale=1.0))

    return shared_folder("learn", fill) / "out"
