"""``fogsim`` and ``python -m fogsim``: the command line, prepared for signals before its libraries are imported."""

from fogsim.core.files.standard_streams import open_standard_streams, print_any_text
from fogsim.core.interruption import leave_on_signals


def main() -> None:
    """Run the command line."""
    open_standard_streams()
    print_any_text()
    leave_on_signals()
    from fogsim.cli.app import main as run_command_line  # noqa: PLC0415 - after signals are provided for

    run_command_line()


if __name__ == "__main__":
    main()
