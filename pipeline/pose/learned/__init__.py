"""Where a dock's lights really are, learned from many views of it."""
