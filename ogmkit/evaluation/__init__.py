"""Runs, metrics and frames brought together: tables of scores."""
