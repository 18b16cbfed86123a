"""Everything that a person can ask for, in one table: menus, tool bar, keys and their sheet come from it."""
