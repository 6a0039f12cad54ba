"""Reading nuScenes-style tables and maps into frozen records."""
