"""Checked parameters of your own methods: types and ranges in annotations."""

from fogsim.core.parameters import Range, accepted_parameters, checked_parameters

__all__ = ["Range", "accepted_parameters", "checked_parameters"]
