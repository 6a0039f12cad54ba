"""What the homography network regresses stays near 0 under every augmentation."""

import numpy as np
import pytest
import torch

from ogmkit.geometry.se3 import inverse
from ogmkit.grid import GridSpec
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.module import Loading, ShardDataModule
from ogmkit.learn.models.four_point_code import FourPointCode
from ogmkit.learn.models.homography_code import EntriesCode
from ogmkit.learn.perception_settings import HomographyTraining
from ogmkit.learn.systems.homography import HomographySystem
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.samples.arrays import SampleArrays, scaled

GRID = GridSpec(0.1, 1000, 550, 1000.0, 300.0)
SIZE = (448, 800)
CODES = {"entries": EntriesCode, "four-point": FourPointCode}
AUGMENTATIONS = {
    "plain": Augmentation(0.0, 0.0),
    "flip": Augmentation(0.0, 1.0),
    "pitch": Augmentation(0.0, 0.0, pitch_deg=2.0),
    "roll": Augmentation(0.0, 0.0, roll_deg=2.0),
    "all": Augmentation(0.0, 0.5, 2.0, 2.0),
}
CHANNELS = ("CAM_FRONT", "CAM_FRONT_LEFT", "CAM_BACK_RIGHT")
"""One ahead, two to the sides, whose mirror images look to the others."""
ROUNDS = 10


def flat_homography(frame):
    """(3, 3) of the resized image, z = 0 of the level frame, by its definition."""
    resized_from_image = np.diag([SIZE[1] / 1600, SIZE[0] / 900, 1.0])
    intrinsics = resized_from_image @ frame.intrinsics
    image_from_plane = intrinsics @ inverse(frame.level_from_camera)[:3, [0, 1, 3]]
    # The sign for which w is positive on ground ahead: z of the camera over the height over the plane.
    matrix = GRID.bev_from_level @ np.linalg.inv(image_from_plane)
    ahead = frame.level_from_camera @ [0, 0, 10, 1]
    pixel = image_from_plane @ [ahead[0], ahead[1], 1]
    sign = np.sign((matrix @ (pixel / pixel[2]))[2])
    return scaled(sign * matrix[None])[0], intrinsics


@pytest.fixture(scope="module")
def real_samples(real_dataroot):
    """Channel → geometry of scene-0103's key frames."""
    with Dataset(real_dataroot) as dataset:
        scene = dataset.scene("scene-0103", cameras=CHANNELS, maps=False)
    return {
        channel: [
            SampleArrays(np.array([SIZE]), bev_from_image=matrix[None], intrinsics=intrinsics[None])
            for matrix, intrinsics in map(flat_homography, frames)
        ]
        for channel, frames in scene.cameras.items()
    }


def drawn(samples, augmentation):
    """Homographies of augmented samples, and which are mirrored."""
    made = [augmentation.apply(sample, GRID, seed) for seed in range(ROUNDS) for sample in samples]
    matrices = torch.from_numpy(np.concatenate([one.bev_from_image for one in made]))
    return matrices, torch.tensor([one.mirrored for one in made])


@pytest.mark.parametrize("name", AUGMENTATIONS)
@pytest.mark.parametrize("kind", CODES.values())
@pytest.mark.parametrize("channel", CHANNELS)
def test_real_targets_are_standard_under_every_augmentation(real_samples, channel, kind, name):
    matrices, mirrored = drawn(real_samples[channel], AUGMENTATIONS[name])
    camera = torch.zeros(len(matrices), dtype=torch.int64)
    code = kind.fit(matrices, camera, 1, SIZE, GRID, mirrored)

    encoded = code.encode(matrices, camera, mirrored)

    assert mirrored.any() == (AUGMENTATIONS[name].flip > 0)
    assert encoded.abs().max() < 8
    assert encoded.abs().quantile(0.95) < 3
    assert encoded.mean(0).abs().max() < 0.8


@pytest.mark.parametrize("head", CODES)
@pytest.mark.parametrize("name", AUGMENTATIONS)
def test_the_fixture_s_targets_are_standard_as_training_prepares_them(learn_shards, head, name):
    settings = HomographyTraining(
        image_size=(64, 96), encoder="tu-test_resnet", head=head, cameras=("CAM_FRONT",)
    )
    grid = GridSpec(0.5, 80, 60, 80.0, 34.0)
    system = HomographySystem(settings, grid, settings.cameras)
    loading = Loading(augmentation=AUGMENTATIONS[name])
    data = ShardDataModule(
        learn_shards, ["scene-0001"], ["scene-0002"], settings.cameras, system.spec, loading=loading
    )
    system.prepare(data.statistics(system.prepare_spec, system.prepare_rounds))

    for batch in data.train_dataloader():
        target = system.code.encode(batch["bev_from_image"], batch["camera"], batch["mirrored"])
        assert target.abs().max() < 8


@pytest.mark.parametrize("kind", CODES.values())
def test_a_mirrored_sample_s_code_tells_the_same_pitch(kind, real_samples):
    """A camera turned down has the same code in the mirror, but for what leans to a side."""
    samples = real_samples["CAM_FRONT"]
    matrices, _ = drawn(samples, AUGMENTATIONS["pitch"])
    camera = torch.zeros(len(matrices), dtype=torch.int64)
    code = kind.fit(matrices, camera, 1, SIZE, GRID)
    mirrored = torch.ones(len(matrices), dtype=torch.bool)

    plain = code.encode(matrices, camera)
    turned = code.encode(code.mirror(matrices), camera, mirrored)

    heights = [1, 3, 5, 7] if kind is FourPointCode else [7]
    for place in heights:
        pair = torch.stack([plain[:, place], turned[:, place]])
        assert torch.corrcoef(pair)[0, 1] > 0.95


@pytest.mark.parametrize("kind", CODES.values())
def test_mirrors_are_their_own_inverse(kind, real_samples):
    matrices, _ = drawn(real_samples["CAM_FRONT_LEFT"], AUGMENTATIONS["plain"])
    code = kind(1, SIZE, GRID)
    torch.testing.assert_close(code.mirror(code.mirror(matrices)), matrices, rtol=1e-8, atol=1e-8)
