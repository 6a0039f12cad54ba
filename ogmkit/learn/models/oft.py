"""Orthographic Feature Transform: from image features to the grid, then a network in BEV.

Roddick, Kendall & Cipolla, Orthographic Feature Transform for Monocular 3D Object Detection, BMVC 2019.
"""

import math
from functools import partial

from torch import Tensor, nn
from torch.nn import functional
from torchvision.models.resnet import BasicBlock

from ogmkit.grid import GridSpec
from ogmkit.learn.models.encoders import ImageEncoder
from ogmkit.learn.models.oft_pooling import box_means, integral_image, voxel_boxes, voxel_corners
from ogmkit.samples.spec import TARGETS

_STAGES = (3, 4, 5)
"""Of the encoder: strides 8, 16 and 32."""
_GROUPS = 16


class OrthographicTransform(nn.Module):
    """Features of one scale, averaged over voxels and collapsed over height by a learnt linear layer.

    Args:
        channels: of the features, before and after.
        layers: of voxels.
    """

    def __init__(self, channels: int, layers: int) -> None:
        super().__init__()
        self.layers = layers
        self.collapse = nn.Linear(layers * channels, channels)

    def forward(self, features: Tensor, boxes: Tensor, size: tuple[float, float]) -> Tensor:
        """From the image to the plane, one layer of voxels after the other: all at once they would not fit.

        Args:
            features: (B, channels, h, w).
            boxes: (B, layers, rows, columns, 4), in features.
            size: (height, width) of the image, in features.

        Returns:
            (B, channels, rows, columns).
        """
        integral = integral_image(features)
        plane: Tensor = self.collapse.bias[:, None, None]
        for layer, weight in enumerate(self.collapse.weight.chunk(self.layers, dim=1)):
            means = box_means(integral, boxes[:, layer], size)
            plane = plane + functional.conv2d(means, weight[..., None, None])
        return functional.relu(plane)


class OftNet(nn.Module):
    """Front end at strides 8, 16 and 32, one transform a stride, a top-down network on their sum.

    The published front end is ResNet-18, the top-down network 8 residual blocks of two layers.
    Normalisation is by groups, as there, in all but the encoder.

    Args:
        encoder: as `ImageEncoder`.
        weights: as `ImageEncoder`.
        grid: that masks are predicted on; the paper's has cells of 1 m.
        heights_m: boundaries of the layers of voxels, above z = 0 of the level frame; the published code
            has 4 m of them about the ground, too.
        channels: of features after the front end.
        blocks: residual blocks of the top-down network.

    Raises:
        SettingsError: as `ImageEncoder`; heights don't rise.
        CheckpointError: as `ImageEncoder`.
    """

    corners_level: Tensor

    def __init__(
        self,
        encoder: str,
        weights: str | None,
        grid: GridSpec,
        *,
        heights_m: tuple[float, ...] = (-2.0, -1.0, 0.0, 1.0, 2.0),
        channels: int = 256,
        blocks: int = 8,
    ) -> None:
        super().__init__()
        norm = partial(nn.GroupNorm, math.gcd(_GROUPS, channels))
        self.encoder = ImageEncoder(encoder, weights)
        self.laterals = nn.ModuleList(
            nn.Sequential(nn.Conv2d(self.encoder.out_channels[stage], channels, 1), norm(channels), nn.ReLU())
            for stage in _STAGES
        )
        self.transforms = nn.ModuleList(OrthographicTransform(channels, len(heights_m) - 1) for _ in _STAGES)
        self.top_down = nn.Sequential(
            *(BasicBlock(channels, channels, norm_layer=norm) for _ in range(blocks))
        )
        self.head = nn.Conv2d(channels, len(TARGETS), 3, padding=1)
        self.register_buffer("corners_level", voxel_corners(grid, heights_m), persistent=False)

    def forward(self, image: Tensor, intrinsics: Tensor, level_from_camera: Tensor) -> Tensor:
        """Logits of drivable and vehicles on the grid.

        Args:
            image: (B, 3, h, w).
            intrinsics: (B, 3, 3) float64 of this image.
            level_from_camera: (B, 4, 4) float64.

        Returns:
            (B, 2, rows, columns).
        """
        boxes_px = voxel_boxes(self.corners_level, intrinsics, level_from_camera)
        height_px, width_px = image.shape[-2:]
        features = self.encoder(image)
        planes = []
        for stage, lateral, transform in zip(_STAGES, self.laterals, self.transforms, strict=True):
            stride = 2**stage
            size = height_px / stride, width_px / stride
            planes.append(transform(lateral(features[stage]), boxes_px / stride, size))
        result: Tensor = self.head(self.top_down(sum(planes)))
        return result
