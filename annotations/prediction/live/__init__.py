"""Volumes that come one after the other, and what a network says of each as it comes."""
