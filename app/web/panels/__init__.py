"""The controls, one file a tab or a part of one: each panel builds, loads and shows its own."""
