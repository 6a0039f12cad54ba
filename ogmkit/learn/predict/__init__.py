"""Predicting with a trained run: from shards or from one's own images, as arrays or files."""
