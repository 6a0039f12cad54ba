"""Shards with everything that an export takes, and their values by plain h5py."""

from itertools import pairwise

import h5py
import pytest


@pytest.fixture(scope="session")
def shards(sample_shards):
    """Two scenes of eight frames of two cameras, with images, LiDAR, homographies and footprints."""
    return sample_shards


@pytest.fixture(scope="session")
def labelled(shared_folder, extract_all, tiny_dataroot, sample_grid):
    """Labels by name beside the paper's, of one camera."""
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.target_settings import TargetSettings

    settings = ExtractSettings(TargetSettings(sample_grid), definitions=("paper", "fiery", "pon"))
    return shared_folder("exports", lambda folder: extract_all(tiny_dataroot, folder, settings)) / "out"


@pytest.fixture(scope="session")
def stored():
    """`stored(folder, scene, group)`: dataset → values of all frames; of boxes and points, arrays a frame."""

    def read(folder, scene, group):
        values = {}

        def note(name, item):
            if isinstance(item, h5py.Dataset):
                values[name] = item.asstr()[:] if h5py.check_string_dtype(item.dtype) else item[:]

        with h5py.File(folder / f"{scene}.h5") as h5:
            h5[group].visititems(note)
        for kind, also in (("boxes", "left_out_"), ("lidar", "none")):
            cuts = values.pop(f"{kind}/offsets", ())
            for name in [name for name in values if name.startswith(kind) or f"/{also}" in name]:
                values[name] = [values[name][first:stop] for first, stop in pairwise(cuts)]
        return values

    return read
