"""The commands that make tables and figures for papers: what errors to expect, the paper's results, the study."""
