"""The systems that can be trained: a network, what it is fed, its loss, and what it predicts."""
