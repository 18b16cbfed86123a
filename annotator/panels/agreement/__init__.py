"""Annotators beside each other, and the consensus that settles them."""
