"""From the command to a running application, or to a picture of its window."""
