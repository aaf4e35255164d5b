"""Commands on images and videos from disk: fog laid on them, estimated in them, and taken from them."""
