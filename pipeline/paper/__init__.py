"""The paper's tables and figures, and the methods that it compares with."""
