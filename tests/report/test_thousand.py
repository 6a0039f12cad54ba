"""A page of a thousand scenes: its size, and that it stays usable."""

import base64
import hashlib
import io
from pathlib import Path

import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.report import shards
from ogmkit.report.choice import MOST_BYTES
from ogmkit.report.distributions import Distributions
from ogmkit.report.page import write_page
from ogmkit.report.part import Part, PicturedFrame
from ogmkit.report.predictions import NONE
from ogmkit.report.settings import ReportSettings
from ogmkit.report.soundness import Soundness
from ogmkit.report.thumbnails import PHOTO_BYTES, PLANE_BYTES
from ogmkit.shards.manifest import Manifest, ShardEntry
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import ShardSummary

SCENES = 1000


def noise(seed, count):
    """So many bytes in base64, which nothing can make smaller."""
    return base64.b64encode(hashlib.shake_256(seed.encode()).digest(count)).decode()


def pictures(scene, index):
    sizes = {"photo": PHOTO_BYTES, "dark": PLANE_BYTES, "light": PLANE_BYTES}
    return tuple(noise(f"{scene} {index} {name}", count) for name, count in sizes.items())


def made(task):
    """What a scene of forty frames gives, without its shard."""
    scene, share = task.entry.scene, int(task.entry.scene[-4:]) / SCENES
    frames = tuple(
        PicturedFrame(
            "CAM_FRONT", index, 0.5 * index, share, index, 5.0, ("trajectory: gap",) * (index < 6), ()
        )
        for index in range(task.frames)
    )
    summary = ShardSummary(
        scene,
        "boston-seaport",
        40,
        28,
        0,
        share,
        0.01,
        (),
        (0.5, 0.5, 0.5),
        task.entry.bytes,
        task.entry.sha256,
    )
    found = tuple(pictures(scene, frame.index) for frame in frames)
    return Part(task.entry, summary, Distributions.empty(), (), (), {}, frames, found)


@pytest.fixture(scope="module")
def thousand(tmp_path_factory):
    """The page."""
    entries = tuple(
        ShardEntry(f"scene-{n:04}", f"scene-{n:04}.h5", "boston-seaport", 40, 9_000_000, "0" * 64, ("train",))
        for n in range(SCENES)
    )
    folder = shards.ShardFolder(
        Path("shards"), Manifest("v1.0-trainval", "nuscenes", ExtractSettings(), entries), None,
        Soundness((), None), NONE,
    )  # fmt: skip
    kept = io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "read_part", made)
        shown = shards.read_shards(folder, ReportSettings(), Execution(), kept.write)
    path = tmp_path_factory.mktemp("thousand") / "report.html"
    kept.seek(0)
    with path.open("wb") as file:
        write_page(file, shown.title, "", shown.sections, shown.frames.html(), kept)
    return path


def test_it_is_below_fifty_megabytes_and_says_how_many_frames_it_shows(thousand):
    size = thousand.stat().st_size
    assert 0.8 * MOST_BYTES < size < MOST_BYTES
    with thousand.open("rb") as file:
        assert b"At most 3 of each scene" in file.read(2_000_000)


@pytest.mark.slow
def test_it_is_leafed_through_in_chromium(browse, thousand):
    with browse() as page:
        page.open(thousand)
        assert page.said == []
        shown = "document.getElementById('shown').textContent"
        assert page.value(shown) == "3,000 of 3,000"
        assert page.value("document.querySelectorAll('#gallery .card').length") < 200
        page.value(
            "(() => { const form = document.getElementById('filters'); form.elements.scene.value = '-099'; "
            "form.dispatchEvent(new Event('input')); })()"
        )
        assert page.value(shown) == "30 of 3,000"
        page.value("document.querySelector('#scenes th:nth-child(7) button').click()")
        values = "[...document.querySelectorAll('#scenes td:nth-child(7)')].map(one => Number(one.dataset.v))"
        assert np.all(np.diff(page.value(values)) >= 0)
        assert page.said == []
