"""The device that networks work on."""

import torch

from ogmkit.learn.settings import Arithmetic, Precision


def best_device() -> torch.device:
    """The GPU, if there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def device_name() -> str:
    """The device in words, such as `cuda (NVIDIA H200)`."""
    device = best_device()
    return f"cuda ({torch.cuda.get_device_name(device)})" if device.type == "cuda" else device.type


def arithmetic(precision: Precision) -> Arithmetic:
    """The precision to compute with: of `auto`, bf16-mixed where the device has instructions for it."""
    if precision != "auto":
        return precision
    return "bf16-mixed" if _has_bfloat16() else "32-true"


def _has_bfloat16() -> bool:
    if torch.cuda.is_available():
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    # torch before 2.9 can't tell
    capabilities: dict[str, object] = getattr(torch.cpu, "get_capabilities", dict)()
    return any(capabilities.get(name, False) for name in ("avx512_bf16", "amx_bf16", "bf16"))


def all_devices() -> tuple[str, ...]:
    """Every device in words, the CPU with its threads and arithmetic, each GPU with its memory."""
    gpus = (torch.cuda.get_device_properties(place) for place in range(torch.cuda.device_count()))
    return (
        f"cpu ({torch.get_num_threads()} threads, {arithmetic('auto')})",
        *(
            f"cuda ({gpu.name}, {gpu.total_memory / 2**30:.0f} GiB, CUDA {torch.version.cuda})"
            for gpu in gpus
        ),
    )
