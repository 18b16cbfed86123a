"""The main window: panes, menus, questions and status line, wired to one session."""
