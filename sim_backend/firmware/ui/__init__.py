"""The user interface of the brick: menus, files, keys, battery and power."""
