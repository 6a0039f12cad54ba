"""Faults, kills and broken inputs for every command, each in a forked process, and what came of them."""
