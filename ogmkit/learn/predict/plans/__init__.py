"""Planning with a trained run, from shards or from six images."""
