"""Predictions beside the truth: errors, plots, checkpoints in pairs, verdicts."""
