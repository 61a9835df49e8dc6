"""Charts of the page: each turns data into the series of one uplot."""
