"""The device that networks work on."""

import torch


def best_device() -> torch.device:
    """The GPU, if there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def device_name() -> str:
    """The device in words, such as `cuda (NVIDIA H200)`."""
    device = best_device()
    return f"cuda ({torch.cuda.get_device_name(device)})" if device.type == "cuda" else device.type
