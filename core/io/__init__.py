"""Files in and out: points, meshes, volumes and reports."""
