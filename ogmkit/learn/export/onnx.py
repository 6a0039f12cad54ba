"""Export of trained systems to ONNX, checked against torch."""

import dataclasses
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import onnx
import onnxruntime
import torch
from torch import Tensor, nn

from ogmkit import __version__
from ogmkit.base.atomic import replacing
from ogmkit.errors import CheckpointError, OutputError, SettingsError
from ogmkit.learn.export.modules import exported
from ogmkit.learn.predict.run import Run, open_run

OPSETS = (16, 20)
"""The lowest and the highest version of ONNX's operators that can be asked for."""
DEFAULT_OPSET = 17

TOLERANCE = 1e-3
_BATCHES = (1, 3)


@dataclass(frozen=True)
class ExportSummary:
    """What was exported.

    Attributes:
        system: the system's name.
        image_size: (height, width) of the model's input.
        inputs: names of the model's inputs.
        cameras: channels that it was trained on, in the order that the input `camera` counts them.
        output: name of the model's output.
        bytes: the file's size.
        difference: largest one from torch's answers on random images, relative where those exceed 1.
    """

    system: str
    image_size: tuple[int, int]
    inputs: tuple[str, ...]
    cameras: tuple[str, ...]
    output: str
    bytes: int
    difference: float


def export(checkpoint: Path, out: Path, *, opset: int = DEFAULT_OPSET) -> ExportSummary:
    """Write a run's network as an ONNX model.

    The input `image` is (B, 3, h, w) float32, RGB, 0 … 1, resized as the metadata's settings say. A
    homography network of several cameras has another, `camera`: (B,) int64, places among the metadata's.
    The output of `footprints` is `probabilities`, (B, 2, h, w) float32 of drivable area and vehicles; that of
    `homography` is `bev_from_image`, (B, 3, 3) float32 from pixels of the resized image to cells of the
    metadata's grid, |h33| = 1, w > 0 on the ground.

    Args:
        checkpoint: a RUN of `footprints` or `homography`, or one of its checkpoints.
        out: the file; what was there is replaced.
        opset: version of ONNX's operators.

    Raises:
        CheckpointError: there is no checkpoint, it is damaged, or onnxruntime's answers are not torch's; no
            file is written then.
        SettingsError: another system can't be exported, or such an opset not be written.
        OutputError: the file can't be written.
    """
    low, high = OPSETS
    if not low <= opset <= high:
        raise SettingsError(f"opset: {opset} is not between {low} and {high}")
    if out.is_dir():
        raise OutputError(f"{out}: is a folder; name a file")
    run = open_run(checkpoint)
    module = exported(run.model.cpu()).eval()
    inputs = _inputs(run, 2)
    with replacing(out) as part:
        _write_graph(module, inputs, module.output, opset, part)
        model = onnx.load(part)
        onnx.helper.set_model_props(model, _metadata(run))
        onnx.checker.check_model(model, full_check=True)
        onnx.save(model, part)
        difference = _difference(run, module, model.SerializeToString())
        if not difference <= TOLERANCE:
            raise CheckpointError(
                f"{run.path}: ONNX's answers differ from torch's by {difference:.2g}, more than "
                f"{TOLERANCE:g}; nothing was written"
            )
    return ExportSummary(
        system=run.system,
        image_size=run.image_size,
        inputs=tuple(inputs),
        cameras=run.cameras,
        output=module.output,
        bytes=out.stat().st_size,
        difference=difference,
    )


def _inputs(run: Run, count: int) -> dict[str, Tensor]:
    """Random inputs of `count` images."""
    generator = torch.Generator().manual_seed(count)
    height, width = run.image_size
    inputs = {"image": torch.rand(count, 3, height, width, generator=generator)}
    if run.system == "homography" and len(run.cameras) > 1:
        inputs["camera"] = torch.arange(count) % len(run.cameras)
    return inputs


def _write_graph(
    module: nn.Module, inputs: Mapping[str, Tensor], output: str, opset: int, path: Path
) -> None:
    """Trace the model and write it; batches may have any size."""
    with warnings.catch_warnings():
        # The exporter that replaces this one needs onnxscript; sizes and checks are constant here.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", torch.jit.TracerWarning)  # type: ignore[attr-defined]
        torch.onnx.export(
            module,
            tuple(inputs.values()),
            path,
            dynamo=False,
            opset_version=opset,
            input_names=list(inputs),
            output_names=[output],
            dynamic_axes={name: {0: "batch"} for name in (*inputs, output)},
        )


def _metadata(run: Run) -> dict[str, str]:
    """What the model says of itself: texts, some of them JSON."""
    return {
        "system": run.system,
        "settings": json.dumps(run.card.settings.to_dict()),
        "grid": json.dumps(dataclasses.asdict(run.grid)),
        "cameras": json.dumps(run.cameras),
        "checkpoint_sha256": run.sha256,
        "package_version": __version__,
    }


def _difference(run: Run, module: nn.Module, model: bytes) -> float:
    """The largest difference of a model from torch over random batches of several sizes."""
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    worst = 0.0
    for count in _BATCHES:
        inputs = _inputs(run, count)
        with torch.inference_mode():
            expected = cast("Tensor", module(*inputs.values())).numpy()
        (found,) = session.run(None, {name: value.numpy() for name, value in inputs.items()})
        error = np.abs(found - expected) / np.maximum(np.abs(expected), 1)
        worst = max(worst, float(error.max())) if np.isfinite(error).all() else float("inf")
    return worst
