"""The errors of checkpoints as plots, pictures and files."""
