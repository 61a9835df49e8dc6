"""From what a person names or sends to pixels with their camera and dock: pictures, sequences, samples, uploads."""
