"""Files that people write and programs keep: YAML read with caps, and writing that no kill and no full disk can spoil.

May import `dockpose.checks`.
"""
