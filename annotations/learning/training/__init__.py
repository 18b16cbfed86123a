"""Training that can be interrupted: its plan, its state on disk, its stages, its validation."""
