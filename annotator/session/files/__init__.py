"""Where the open document is kept: locked, saved, recovered, left for the next one, derived from."""
