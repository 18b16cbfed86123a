"""The volume in three dimensions: a Mayavi scene with one layer a file."""
