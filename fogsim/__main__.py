"""``python -m fogsim`` is the command line."""

from fogsim.cli import main

main()
