"""The block ``expect`` of scenario files, and conditions in them."""
