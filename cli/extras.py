"""What commands need beyond the core."""

_TRAIN = ("torch", "lightning", "segmentation_models_pytorch", "kornia", "torchmetrics", "yaml")
_ONNX = ("onnx", "onnxruntime")


def require_train() -> None:
    """Refuse to continue without the extra `train`.

    Raises:
        MissingPackageError: one of its packages is absent; says how to install it.
    """
    from ogmkit.base.extras import require_packages

    require_packages("train", _TRAIN)


def require_yaml() -> None:
    """Refuse to continue without YAML, which comes with the extra `train`.

    Raises:
        MissingPackageError: it is absent; says how to install it.
    """
    from ogmkit.base.extras import require_packages

    require_packages("train", ("yaml",))


def require_onnx() -> None:
    """Refuse to continue without the extra `onnx`.

    Raises:
        MissingPackageError: one of its packages is absent; says how to install it.
    """
    from ogmkit.base.extras import require_packages

    require_packages("onnx", _ONNX)
