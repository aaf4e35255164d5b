"""The picture of a step: camera frame or view from above, and beside it a panel."""
