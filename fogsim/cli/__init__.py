"""The command line: one file per command; arguments, progress and exit codes only."""
