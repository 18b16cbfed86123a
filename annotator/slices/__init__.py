"""Three linked slices across the volume's axes: painted with Qt alone, read without waiting for the disk."""
