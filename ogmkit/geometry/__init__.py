"""Rigid transforms, pinhole cameras and polygons: plain numpy, no files."""
