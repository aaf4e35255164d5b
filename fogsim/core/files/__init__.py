"""Readers and writers of files: limits on what is read, and no half-written results."""
