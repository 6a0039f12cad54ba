"""Samples for training: read from shards, resized, augmented, batched."""
