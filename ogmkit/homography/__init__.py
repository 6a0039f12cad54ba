"""Homographies from the camera image to the bird's-eye view, and the ground surface behind them."""
