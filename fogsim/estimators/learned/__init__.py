"""Learned estimators: networks in ONNX files, and the calibration of their intervals."""

from fogsim.estimators.learned.onnx_guest import OnnxGuest, conformal_factor, onnx_guest

__all__ = ["OnnxGuest", "conformal_factor", "onnx_guest"]
