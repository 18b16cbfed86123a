"""The window that shows volumes as they come."""
