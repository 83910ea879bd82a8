"""Make ``python -m tuckerl`` the command."""

from tuckerl.cli import main

if __name__ == "__main__":  # worker processes import this module too
    main()
