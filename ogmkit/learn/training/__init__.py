"""Training a system: the loop, what it saves, what it shows."""
