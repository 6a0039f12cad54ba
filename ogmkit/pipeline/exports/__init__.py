"""Shards in the layouts of others: tar files for WebDataset, Parquet, Hugging Face datasets."""
