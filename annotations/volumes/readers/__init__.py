"""One module a file format: each finds the arrays in a file and hands out one of them, unread."""
