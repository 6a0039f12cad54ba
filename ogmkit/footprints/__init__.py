"""Flatmobiles: drivable area and the vehicles' ground faces as masks in camera view (DESIGN §2, §3)."""
