"""The committed dataset is what its script makes: tables exactly, pixels nearly."""

import importlib.util
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


@pytest.fixture(scope="module")
def remade(tmp_path_factory):
    from ogmkit.synthetic.build import synthesize

    spec = importlib.util.spec_from_file_location("make_fixtures", FIXTURES / "make_fixtures.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    out = tmp_path_factory.mktemp("fixture") / "dataset"
    synthesize(out, script.SETTINGS)
    return script.FIXTURE, out


def names(root):
    return sorted(path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file())


def test_fixture_has_the_same_files_and_is_small(remade):
    committed, made = remade
    assert names(committed) == names(made)
    assert sum((committed / name).stat().st_size for name in names(committed)) <= 3_000_000


def test_fixture_has_the_same_tables(remade):
    committed, made = remade
    for name in names(made):
        if name.startswith("v1.0-") or name == "splits.json":
            assert json.loads((committed / name).read_text()) == json.loads((made / name).read_text()), name


def test_fixture_has_nearly_the_same_pixels(remade):
    _, made = remade
    images = [name for name in names(made) if name.endswith((".jpg", ".png"))]
    assert len(images) == 40 + 2  # of one camera in two scenes of 20 frames, and two maps
    for name in images:
        one, other = (cv2.imread(str(root / name), cv2.IMREAD_UNCHANGED) for root in remade)
        assert one.shape == other.shape
        difference = cv2.absdiff(one, other)
        assert (difference > 40).mean() < 0.005, name
        assert difference.mean() < 2.0, name


def test_fixture_has_nearly_the_same_points(remade):
    _, made = remade
    for name in names(made):
        if name.endswith(".pcd.bin"):
            one, other = (np.fromfile(root / name, dtype=np.float32) for root in remade)
            assert abs(len(one) - len(other)) <= 0.01 * len(one), name
            if len(one) == len(other):
                assert np.median(np.abs(one - other)) < 1e-3
