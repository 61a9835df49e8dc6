"""Everything a person touches: the command line, the page in the browser, pictures and files to take away."""
