"""Drawing from arrays: colours, canvas, the plane, sheets and their legends; no shard, no network."""
