"""Commands about this machine rather than about pictures: the page's service, a check of it, shell completion."""
