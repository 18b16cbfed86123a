"""The networks, and the settings from which each is built."""
