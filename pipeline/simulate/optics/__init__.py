"""How light gets through water: absorption and scattering, point spread functions, glow.

Imports nothing else of the simulator.
"""
