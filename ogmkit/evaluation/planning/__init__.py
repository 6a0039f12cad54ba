"""Scores of plans of the next seconds: numpy in, numbers out."""
