"""What is open, how it is looked at, and every change of it: no widget, no drawing."""

from annotator.session.session import Session

__all__ = ["Session"]
