"""One page that shows what shards, trainings and tables hold: a file of HTML that needs nothing else."""
