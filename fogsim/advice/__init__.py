"""Belief to advised speed."""
