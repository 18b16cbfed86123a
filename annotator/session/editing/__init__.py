"""What a person does to the open document, and what the geometry makes of it."""
