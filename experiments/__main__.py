"""`python -m experiments` is `nusselt`."""

from .cli import main

if __name__ == "__main__":
    main()
