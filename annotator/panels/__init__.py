"""The panels around the views: what to annotate, the keypoints, what follows from them, the display."""
