"""The controls, one file a tab or a part of one: each panel builds, loads and shows its own.

May import charts, widgets and html; panels do not import each other, but for the folder experiment/.
"""
