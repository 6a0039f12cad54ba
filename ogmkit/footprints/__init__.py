"""Flatmobiles: drivable area and the vehicles' ground faces as masks in camera view (design.md §2, §3)."""
