"""Commands on images and videos from disk: add, measure and remove fog."""
