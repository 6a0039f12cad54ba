"""Networks and what they are made of; each knows tensors only."""
