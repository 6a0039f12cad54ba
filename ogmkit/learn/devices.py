"""The device that networks work on."""

import os

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


def shares(count: int) -> tuple[dict[str, str], ...]:
    """Environment variables of processes that share this machine: a GPU for each, or threads of the CPU.

    Args:
        count: how many processes there are. GPUs are dealt out in turns, those of `CUDA_VISIBLE_DEVICES`
            where it is set. `OMP_NUM_THREADS`, where it is set, is each one's number of threads.
    """
    named = os.environ.get("CUDA_VISIBLE_DEVICES")
    gpus = [*map(str, range(torch.cuda.device_count()))] if named is None else named.split(",")
    if torch.cuda.is_available():
        return tuple({"CUDA_VISIBLE_DEVICES": gpus[number % len(gpus)]} for number in range(count))
    threads = max(1, torch.get_num_threads() // count)
    return ({"OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", str(threads))},) * count


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
