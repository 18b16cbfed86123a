"""Other programs' files, in and out: landmark lists of 3D Slicer, files for training networks."""
