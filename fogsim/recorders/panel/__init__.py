"""The picture of a step: camera frame or view from above, and next to it a panel."""
