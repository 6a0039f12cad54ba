"""What tests of labels share: peers' labels, key frames of their datasets, and rules written out slowly."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from ogmkit.labels.catalogue import PRESETS
from ogmkit.labels.definition import without_map
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import open_expansion

FIXTURE = Path(__file__).resolve().parents[2] / "fixtures" / "nuscenes-synthetic"
PEERS = {
    "lss": "lift-splat-shoot",
    "fiery": "fiery",
    "cvt": "cross_view_transformers",
    "pon": "mono-semantic-maps",
    "bevfusion": "bevfusion",
    "pointbev": "PointBeV",
    "stp3": "ST-P3",
}


@pytest.fixture(scope="session")
def fixture_root():
    """The small synthetic dataset that the repository holds."""
    return FIXTURE


@pytest.fixture(scope="session")
def key_frames():
    """All key frames of a dataset: `key_frames(root)`, by sample token."""
    known = {}

    def read(root):
        if root not in known:
            with Dataset(root) as dataset:
                known[root] = {
                    frame.sample_token: frame
                    for scene in dataset.scene_names()
                    for frame in dataset.key_frames(scene, lidar="LIDAR_TOP", camera="CAM_FRONT")
                }
        return known[root]

    return read


@pytest.fixture(scope="session")
def peer(peer_labels):
    """A peer's labels on a dataset: `peer(name, root)`, token → array → what the repository's code gave."""

    def read(name, root):
        path = peer_labels / f"{PEERS[name]}__{root.name}.npz"
        return unpacked(np.load(path))

    return read


def unpacked(archive):
    """Token → array's name → (rows, columns)."""
    arrays = {}
    for stack in ("labels", "vehicle", "road", "valid", "ignore"):
        if f"{stack}_packed" in archive:
            shape = archive[f"{stack}_shape"]
            bits = np.unpackbits(archive[f"{stack}_packed"])[: np.prod(shape)].reshape(shape)
            arrays |= {str(name): bits[:, i] for i, name in enumerate(archive[f"{stack}_classes"])}
    arrays |= {name: archive[name] for name in ("instance", "visibility") if name in archive}
    if "visibility_drawn" in archive:
        arrays["visibility"] = archive["visibility_drawn"]
    tokens = archive["sample_tokens"].tolist()
    return {token: {name: array[i] for name, array in arrays.items()} for i, token in enumerate(tokens)}


@pytest.fixture(scope="session")
def preset():
    """A preset as far as a dataset allows it, and a location's map: `preset(name, root, location)`."""

    def find(name, root, location):
        definition = PRESETS[name]
        if not (root / "maps" / "expansion").is_dir():
            return without_map(definition), None
        return definition, open_expansion(root, location) if definition.needs_map else None

    return find


@pytest.fixture(scope="session")
def slow_fill():
    """The rule of a filled polygon, a point at a time: `slow_fill(rings, shape)` → (rows, columns) uint8."""

    def fill(rings, shape):
        canvas = np.zeros(shape, np.uint8)
        spans = defaultdict(list)
        for ring in rings:
            for (x1, y1), (x2, y2) in zip(
                np.roll(ring, 1, axis=0).tolist(), np.asarray(ring).tolist(), strict=True
            ):
                plot_line(canvas, x1, y1, x2, y2)
                if y1 != y2:
                    (xt, yt), (xb, yb) = sorted([(x1, y1), (x2, y2)], key=lambda end: end[1])
                    slope = int((xb - xt) * 65536 / (yb - yt))
                    for y in range(yt, yb):
                        spans[y].append(xt * 65536 + (y - yt) * slope)
        for y, found in spans.items():
            found.sort()
            for a, b in zip(found[::2], found[1::2], strict=True):
                for x in range(-(-a // 65536), b // 65536 + 1):
                    plot(canvas, x, y)
        return canvas

    return fill


def plot(canvas, x, y):
    if 0 <= y < canvas.shape[0] and 0 <= x < canvas.shape[1]:
        canvas[y, x] = 1


def plot_line(canvas, x1, y1, x2, y2):
    """Bresenham's line from the end with the smaller x, after clipping in whole numbers."""
    right, bottom = canvas.shape[1] - 1, canvas.shape[0] - 1
    if max(x1, x2) < 0 or max(y1, y2) < 0 or min(x1, x2) > right or min(y1, y2) > bottom:
        return
    if not 0 <= y1 <= bottom:
        a = 0 if y1 < 0 else bottom
        x1, y1 = x1 + int((a - y1) * (x2 - x1) / (y2 - y1)), a
    if not 0 <= y2 <= bottom:
        a = 0 if y2 < 0 else bottom
        x2, y2 = x2 + int((a - y2) * (x2 - x1) / (y2 - y1)), a
    if max(x1, x2) < 0 or min(x1, x2) > right:
        return
    if not 0 <= x1 <= right:
        a = 0 if x1 < 0 else right
        y1, x1 = y1 + int((a - x1) * (y2 - y1) / (x2 - x1)), a
    if not 0 <= x2 <= right:
        a = 0 if x2 < 0 else right
        y2, x2 = y2 + int((a - x2) * (y2 - y1) / (x2 - x1)), a
    if x1 > x2:
        x1, y1, x2, y2 = x2, y2, x1, y1
    dx, dy, up = x2 - x1, abs(y2 - y1), 1 if y2 > y1 else -1
    major, minor = max(dx, dy), min(dx, dy)
    error = major - 2 * minor
    for _ in range(major + 1):
        plot(canvas, x1, y1)
        aside = error < 0
        error += 2 * major * aside - 2 * minor
        if dx >= dy:
            x1, y1 = x1 + 1, y1 + up * aside
        else:
            x1, y1 = x1 + aside, y1 + up
