"""How the volume is looked at: a frozen model, and what is on its way without being an edit."""
