"""Questions to a person, and answers: what it is about, what can be done, and nothing is lost."""
