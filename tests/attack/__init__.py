"""The running page under attack, over the loopback only: ``make security``.

Each attacker has a loopback address of its own (127.0.1.1, 127.0.1.2, ...), so that the log tells them apart; that
works on Linux.
"""
