"""Networks, training and evaluation: the one room that needs PyTorch."""
