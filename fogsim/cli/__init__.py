"""The command line: one file a command; arguments, progress and exit codes, nothing else."""
