"""Tables and figures of the paper, and the methods it compares with.

May import all of the library but `dockpose.sources`.
"""
