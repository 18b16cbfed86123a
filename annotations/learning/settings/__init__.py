"""What a training is told: the network, the losses, the examples' variation, the steps."""
