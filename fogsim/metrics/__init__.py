"""Surrogate safety, comfort and estimator error."""
