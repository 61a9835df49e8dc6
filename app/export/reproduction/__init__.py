"""The paper's figures and tables beside ours: one file for each group of them, and the report that gathers them."""
