"""The volumes of a study or of files: which there are, how one is opened, and how its levels are read."""
