"""Runs, metrics and frames brought together: tables of what predictions are worth."""
