"""What stands between the network and viser: the guarded start, extra pages, capped uploads."""
