"""The study's page: plots, tables, and what they say in words, all computed from its file."""
