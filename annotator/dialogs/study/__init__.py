"""Making a study, changing it, and finding what is wrong with it."""
