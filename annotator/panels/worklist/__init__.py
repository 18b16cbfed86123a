"""The volumes to annotate, and how far each is."""
