"""Trained networks as ONNX."""
