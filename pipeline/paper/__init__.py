"""Tables and figures of the paper, and the methods it compares with; may import all of the library but sources."""
