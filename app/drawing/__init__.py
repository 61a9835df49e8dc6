"""Pictures of a result, as pixels or as vectors; the one table of colours, and the one set of number formats."""
