"""`python -m ogmkit`: the command, which the library does not import otherwise."""

import runpy

if __name__ == "__main__":
    runpy.run_module("ogmkit_cli", run_name="__main__")
