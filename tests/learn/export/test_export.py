import json

import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, OutputError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.export import onnx as module
from ogmkit.learn.export.modules import through_four_points
from ogmkit.learn.export.onnx import export
from ogmkit.learn.models.projective import through_four_points as solved
from ogmkit.learn.models.projective import unit_h33
from ogmkit.learn.predict.run import open_run

onnx = pytest.importorskip("onnx", reason="onnx is not installed: pip install 'ogmkit[onnx]'")
onnxruntime = pytest.importorskip("onnxruntime", reason="onnx is not installed: pip install 'ogmkit[onnx]'")
GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
BOTH = ("CAM_BACK", "CAM_FRONT")
SIZE = (70, 100)
TRUE = torch.tensor([[-1.2, 2.0, 70.0], [0.1, 0.2, -95.0], [0.001, -0.03, 1.0]], dtype=torch.float64) * -1
"""A homography of pixels at this size that sees the ground in the lower half."""


def lively(net):
    """Factors of the code, and a last layer whose answers differ from image to image."""
    noise = torch.randn(20, 3, 3, dtype=torch.float64).mul(0.01) * TRUE
    cameras = torch.arange(20) % len(net.cameras)
    shift = torch.diag(torch.ones(3, dtype=torch.float64))
    shift[0, 2] = 7.0
    matrices = torch.where(cameras[:, None, None] == 0, TRUE + noise, shift @ (TRUE + noise))
    fitted = type(net.code).fit(matrices, cameras, len(net.cameras), net.settings.image_size, net.grid)
    net.code.load_state_dict(fitted.state_dict())
    torch.nn.init.normal_(net.net.layers[-1].weight, std=0.5)


def answers(path, **inputs):
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    (found,) = session.run(None, inputs)
    return found


@pytest.mark.sampled(2)
@pytest.mark.parametrize("cameras", [("CAM_FRONT",), BOTH])
@pytest.mark.parametrize("head", ["entries", "four-point"])
def test_onnx_gives_the_homographies_that_the_system_predicts(tmp_path, make_run, head, cameras):
    run = make_run(
        tmp_path / "run", "homography", GRID, cameras, lively, head=head, image_size=SIZE, encoder="resnet18"
    )
    out = tmp_path / "model.onnx"
    summary = export(run, out)
    assert summary.difference < 1e-4
    assert summary.inputs == (("image",) if len(cameras) == 1 else ("image", "camera"))
    image = torch.rand(5, 3, *SIZE)
    camera = torch.tensor([0, 1, 1, 0, 1]) % len(cameras)
    with torch.inference_mode():
        expected = (
            open_run(run).model.cpu().predict({"image": image, "camera": camera}).bev_from_image.numpy()
        )
    assert np.ptp(expected[camera == 0], axis=0).max() > 0.1  # or the test could not fail
    inputs = {"image": image.numpy(), "camera": camera.numpy()}
    found = answers(out, **{name: inputs[name] for name in summary.inputs})
    assert (found.dtype, found.shape) == (np.float32, (5, 3, 3))
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-5)


def test_onnx_gives_the_masks_that_the_system_predicts(tmp_path, make_run):
    run = make_run(tmp_path / "run", "footprints", GRID, BOTH, image_size=SIZE)
    out = tmp_path / "model.onnx"
    summary = export(run, out)
    assert (summary.system, summary.image_size, summary.output) == ("footprints", SIZE, "probabilities")
    assert summary.bytes == out.stat().st_size
    image = torch.rand(3, 3, *SIZE)
    with torch.inference_mode():
        expected = open_run(run).model.cpu().predict({"image": image}).image.numpy()
    found = answers(out, image=image.numpy())
    assert (found.dtype, found.shape) == (np.float32, (3, 2, *SIZE))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_the_model_says_what_it_is(tmp_path, make_run):
    run = make_run(tmp_path / "run", "footprints", GRID, BOTH, image_size=SIZE)
    export(run, tmp_path / "model.onnx", opset=18)
    model = onnx.load(tmp_path / "model.onnx")
    told = {entry.key: entry.value for entry in model.metadata_props}
    assert told["system"] == "footprints"
    assert json.loads(told["settings"])["image_size"] == [70, 100]
    assert GridSpec(**json.loads(told["grid"])) == GRID
    assert json.loads(told["cameras"]) == list(BOTH)
    assert [entry.version for entry in model.opset_import] == [18]


def test_a_name_that_is_not_utf8_is_written_all_the_same(tmp_path, make_run):
    run = make_run(tmp_path / "run", "footprints", GRID, BOTH, image_size=SIZE)
    export(run, tmp_path / "model\udc80.onnx")
    assert [path.name for path in tmp_path.glob("*.onnx")] == ["model\udc80.onnx"]


def test_a_model_that_answers_otherwise_is_not_written(tmp_path, make_run, monkeypatch):
    run = make_run(tmp_path / "run", "footprints", GRID, BOTH, image_size=SIZE)
    out = tmp_path / "models" / "model.onnx"
    out.parent.mkdir()
    out.write_text("what was there")
    monkeypatch.setattr(module, "TOLERANCE", -1.0)
    with pytest.raises(CheckpointError, match="ONNX's answers differ from torch's"):
        export(run, out)
    assert [path.read_text() for path in out.parent.iterdir()] == ["what was there"]


def test_a_network_without_factors_is_not_written(tmp_path, make_run):
    run = make_run(tmp_path / "run", "homography", GRID, BOTH, image_size=SIZE)  # they are NaN
    with pytest.raises(CheckpointError, match="differ from torch's by inf"):
        export(run, tmp_path / "model.onnx")
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_what_cant_be_exported_is_named(tmp_path, make_run):
    run = make_run(tmp_path / "run", "oft", GRID, BOTH, bev_cell_m=1.0)
    with pytest.raises(SettingsError, match="a run of oft can't be exported, only footprints and homography"):
        export(run, tmp_path / "model.onnx")
    with pytest.raises(SettingsError, match="opset: 5 is not between"):
        export(run, tmp_path / "model.onnx", opset=5)
    with pytest.raises(OutputError, match="is a folder"):
        export(run, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_the_closed_form_through_four_points_is_the_solution():
    torch.manual_seed(1)
    source = torch.tensor([[15.0, 90], [85, 92], [28, 68], [72, 69]], dtype=torch.float64)
    destination = torch.tensor([[250.0, 980], [350, 970], [200, 700], [420, 690]], dtype=torch.float64)
    source = source + torch.randn(50, 4, 2, dtype=torch.float64) * 3
    destination = destination + torch.randn(50, 4, 2, dtype=torch.float64) * 20
    found = through_four_points(source, destination)
    assert torch.allclose(unit_h33(found), unit_h33(solved(source, destination)), rtol=1e-9)
    mapped = torch.cat([source, torch.ones(50, 4, 1, dtype=torch.float64)], dim=2) @ found.transpose(1, 2)
    assert bool((mapped[..., 2] > 0).all())
    assert torch.allclose(mapped[..., :2] / mapped[..., 2:], destination)
