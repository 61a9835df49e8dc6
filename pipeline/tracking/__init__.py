"""Following a dock over frames: both pose hypotheses, the chains they form, where to look next.

May import everything up to `estimate`.
"""
