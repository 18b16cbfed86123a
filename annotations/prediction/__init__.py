"""From a checkpoint and a volume to predicted keypoints, and their errors against documents."""
