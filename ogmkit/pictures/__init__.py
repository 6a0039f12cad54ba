"""Pictures of shards, for people who would rather look than read."""
