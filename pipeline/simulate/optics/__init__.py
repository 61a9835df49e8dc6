"""How light travels through water: absorption and scattering, point spread functions, glow.

May import `dockpose.checks` and the scene and emitters of the simulator.
"""
