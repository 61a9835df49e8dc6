"""Estimating a view, by one method or all, a sequence, or many files in parallel; knows nothing of page and exports."""
