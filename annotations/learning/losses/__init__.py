"""What a network is taught by."""
