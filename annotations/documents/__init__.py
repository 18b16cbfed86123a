"""What a person said about a volume: the model, its edits and checks, its files and studies."""
