"""The desktop application: annotate full-size OCT volumes in 3D and in linked slices."""
