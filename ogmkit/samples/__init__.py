"""Samples of shards, free of torch: which frames, what they hold, how they are read."""
