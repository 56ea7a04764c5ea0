"""``python -m saltus`` is the command ``saltus``."""

from saltus.cli import main

if __name__ == "__main__":
    main()
