"""Masks on the BEV grid: drivable area, vehicles, field of view, LiDAR."""
