"""``python -m graspmoduli``."""

from .cli import main

main()
