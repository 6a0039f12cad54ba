"""Samples for training: read from shards, resized, augmented, batched; needs the extra `train`."""

from ogmkit.base.extras import require_packages

require_packages("train", ("torch",))
