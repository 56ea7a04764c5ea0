"""``python -m saltus.cli``."""

from saltus.cli import main

main()
