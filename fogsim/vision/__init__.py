"""Image operations that estimators share."""
