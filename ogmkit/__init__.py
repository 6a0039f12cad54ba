"""Exact bird's-eye-view ground truth from nuScenes-style datasets."""

__version__ = "0.1.0"
