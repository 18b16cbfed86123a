"""Published comparisons of networks and losses, repeated on synthetic volumes."""
