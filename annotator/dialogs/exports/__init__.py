"""What is asked before something is exported, and what is said of it after."""
