"""What a trained planner plans: for shards, for folders of images, as arrays and as JSON objects."""
