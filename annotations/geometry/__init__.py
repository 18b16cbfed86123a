"""Frames, rotations, the tool specification, its kinematics and the pose targets."""
