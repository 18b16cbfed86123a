"""The open document's file, its copy against a crash, and the undo of its edits."""
