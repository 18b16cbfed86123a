"""Checkpoints, what they predict, and what a reviewer says of it."""
