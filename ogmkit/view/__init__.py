"""A Rerun recording of shards and predictions, to be moved about in."""
