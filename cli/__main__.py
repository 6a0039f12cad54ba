"""`python -m ogmkit_cli`."""

from .main import main

main(prog_name="ogmkit")
