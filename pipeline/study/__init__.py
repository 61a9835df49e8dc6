"""Monte Carlo on the simulator, and error budgets; may import all of the library but sources and paper."""
