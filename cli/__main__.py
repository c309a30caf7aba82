"""`python -m cli` is `pebble`."""

from cli.main import main

main()
