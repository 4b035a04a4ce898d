"""The command ``inband``; also ``python -m app``. What it can do lies in ``app/cli/``."""

from app.cli import main

if __name__ == "__main__":
    main()
