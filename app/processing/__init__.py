"""Estimating a view, with one method or with all, a sequence, or many files in parallel.

May import state, experiment, drawing, inputs and the library; nothing of the page, the exports or the commands.
"""
