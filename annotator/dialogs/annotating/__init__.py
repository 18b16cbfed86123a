"""Questions about the instrument and how it is annotated."""
