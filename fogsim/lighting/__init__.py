"""Belief and traffic to lamp states."""
