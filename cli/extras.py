"""What commands need beyond the core."""

import importlib.util

_TRAIN = ("torch", "lightning", "segmentation_models_pytorch", "kornia", "torchmetrics", "yaml")
_ONNX = ("onnx", "onnxruntime")


def require_train() -> None:
    """Refuse to go on without the extra `train`.

    Raises:
        SettingsError: one of its packages is absent; says how to install it.
    """
    _require("train", _TRAIN)


def require_onnx() -> None:
    """Refuse to go on without the extra `onnx`.

    Raises:
        SettingsError: one of its packages is absent; says how to install it.
    """
    _require("onnx", _ONNX)


def _require(extra: str, packages: tuple[str, ...]) -> None:
    from ogmkit.errors import SettingsError

    for name in packages:
        if importlib.util.find_spec(name) is None:
            raise SettingsError(f"needs {name}, which is not installed: pip install 'ogmkit[{extra}]'")
