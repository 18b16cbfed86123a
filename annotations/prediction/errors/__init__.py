"""How far predictions are from the truth: keypoints, pose, checkpoints in pairs, and the human floor."""
