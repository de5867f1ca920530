"""`python -m nusselt` is `nusselt`."""

from nusselt.experiments.cli.main import main

if __name__ == "__main__":
    main()
