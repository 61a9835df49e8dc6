"""One file a command of ``dockpose``, with the console and the files it writes; may import all else of the app."""
