"""Results beside a measured trajectory: read back, and what the comparison says, in words, tables and plots."""
