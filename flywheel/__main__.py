"""`python -m flywheel` is the program `flywheel`."""

from flywheel.cli import main

if __name__ == "__main__":
    main(prog_name="flywheel")
