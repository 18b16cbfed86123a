"""What only a person can answer about a file: what it holds, whose it is, what of it is kept."""
