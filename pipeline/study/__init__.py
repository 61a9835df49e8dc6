"""Monte Carlo on the simulator: scenes drawn at random, every method on each, what comes of it; and error budgets.

May import all of the library but `dockpose.sources` and `dockpose.paper`.
"""
