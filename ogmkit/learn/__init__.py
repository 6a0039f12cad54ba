"""Networks on shards: the only place with torch; needs the extra `train`."""
