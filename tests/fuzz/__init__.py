"""Inputs that nobody would make on purpose: see :mod:`tests.fuzz.__main__` for how they are drawn and judged.

``targets`` has what is attacked, ``mutate`` makes inputs, ``run`` judges them, ``corpus/`` keeps what was once found.
"""
