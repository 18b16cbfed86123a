"""What is placed, and what follows from it: keypoints or boxes, pose, fit, likely mistakes."""
