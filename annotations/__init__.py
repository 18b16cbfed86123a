"""Everything about annotations of OCT volumes that needs no screen.

Works with neither Qt nor VTK installed. The desktop application is the package `annotator`, which
imports this one and is never imported by it.
"""

__version__ = "0.1.0"
