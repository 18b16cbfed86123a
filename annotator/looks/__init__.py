"""What every part of the window looks like: colours, labels, numbers as people type and read them."""
