"""What a network learns from: volumes that are synthesised or annotated, and their variation."""
