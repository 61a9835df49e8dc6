"""``make peers``: the comparison is in a module of another name, which its processes can load."""

from tests.bench.peers.compare import main

if __name__ == "__main__":
    main()
