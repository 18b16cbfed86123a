"""The panels around the views: what is to do, where the keypoints are, what follows from them, how it is drawn."""
