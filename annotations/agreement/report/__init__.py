"""An agreement as files that people read: JSON, CSV, HTML and PDF, all from the same numbers."""
