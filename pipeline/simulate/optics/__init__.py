"""How light travels through water: absorption and scattering, point spread functions, glow."""
