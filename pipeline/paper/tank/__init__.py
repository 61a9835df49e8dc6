"""The tank of the paper's Tables 2 to 4: its poses on rendered pictures, and what a believable tank brings."""
