"""What a reviewer said of an error: who is wrong, the network or the annotation."""
