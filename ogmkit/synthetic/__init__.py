"""A valid nuScenes-style dataset out of nothing."""
