"""Camera frames with their ground truth: from a step in Python, or as a data set on disk."""

from fogsim.dataset.directory import decoded_depth, decoded_transmission, encoded_depth, encoded_transmission, read_png
from fogsim.dataset.ground_truth import SemanticClass, depth, instance_mask, semantic_mask, sign_picture, transmission
from fogsim.dataset.write import WrittenDataset, write_dataset

__all__ = [
    "SemanticClass",
    "WrittenDataset",
    "decoded_depth",
    "decoded_transmission",
    "depth",
    "encoded_depth",
    "encoded_transmission",
    "instance_mask",
    "read_png",
    "semantic_mask",
    "sign_picture",
    "transmission",
    "write_dataset",
]
