"""What the paper's figures show of lights: how water spreads them, and which level keeps them apart."""
