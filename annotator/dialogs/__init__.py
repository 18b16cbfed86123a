"""Questions to a person, and answers: each dialog says what it is about, what can be done, and loses nothing."""
