"""``python -m graspmoduli``."""

from _graspmoduli_command import main

main()
