"""The document behind the page: one frozen View, every change to it, and the tables of what controls set."""
