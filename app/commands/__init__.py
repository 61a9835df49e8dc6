"""One file a command of ``dockpose``: its arguments and what it does, with the console and the files it writes.

The top of the application: may import any other folder of the app, which in turn know nothing of commands.
"""
