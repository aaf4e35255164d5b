"""Visibility estimators, one method a module, in one registry: published ones and three of this project's own."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from fogsim.core import registry
from fogsim.core.parameters import checked_parameters
from fogsim.core.registry import Registry
from fogsim.estimators.cramer_rao import FoggyRoad, extinction_bound
from fogsim.estimators.learned import OnnxGuest, conformal_factor, onnx_guest
from fogsim.estimators.protocol import Estimator, TakesCalibrations
from fogsim.values.camera import Camera


def _refusing(estimator: Callable[..., Estimator]) -> Callable[..., Estimator]:
    """An estimator's class whose `update` refuses what is not an `Observation`."""
    estimator.update = checked_parameters(estimator.update)  # type: ignore[attr-defined]
    return estimator


ESTIMATORS: Registry[Callable[..., Estimator]] = Registry(
    "estimator",
    {
        "negru2013": "fogsim.estimators.negru2013:Negru2013",
        "zhu2015": "fogsim.estimators.zhu2015:Zhu2015",
        "huang2015": "fogsim.estimators.huang2015:Huang2015",
        "huang2015_rough": "fogsim.estimators.huang2015:Huang2015Rough",
        "huang2015_lead": "fogsim.estimators.huang2015_lead:Huang2015Lead",
        "belaroussi2015": "fogsim.estimators.signs.belaroussi2015:Belaroussi2015",
        "joint_road": "fogsim.estimators.joint_road:JointRoad",
        "lead_contrast": "fogsim.estimators.lead_contrast:LeadContrast",
        "sign_contrast": "fogsim.estimators.signs.sign_contrast:SignContrast",
        "gallen2014_veil": "fogsim.estimators.night.gallen2014_veil:Gallen2014Veil",
        "night_road": "fogsim.estimators.night.night_road:NightRoad",
        "hautiere2006_stereo": "fogsim.estimators.other_sensors.hautiere2006_stereo:Hautiere2006Stereo",
        "gallen2014": "fogsim.estimators.night.gallen2014:Gallen2014",
        "gallen2014_halo": "fogsim.estimators.night.gallen2014:Gallen2014Halo",
        "gabb2014": "fogsim.estimators.other_sensors.gabb2014:Gabb2014",
        "scatterometer": "fogsim.estimators.other_sensors.scatterometer:Scatterometer",
    },
    group="fogsim.estimators",
    methods=("update", "reset"),
    files={"onnx": onnx_guest},
    prepared=_refusing,
)
"""Every estimator by name: called with a camera and keyword parameters it gives an `Estimator`.

``onnx:model.onnx`` is a network in a file (`OnnxGuest`)."""


@checked_parameters
def make(name: str, camera: Camera, **options: object) -> Estimator:
    """Build an estimator.

    An estimator that needs a calibration of the camera, and is given no file of it, calibrates the camera when it first
    needs to; calibrations of halos and signs are cached (``FOGSIM_CACHE_DIR``).

    Parameters
    ----------
    name : str
        Name in `ESTIMATORS`, or ``onnx:FILE``.
    camera : Camera
        The assumed calibration.
    **options : object
        Parameters of the estimator.

    Raises
    ------
    UnknownNameError
        If there is no estimator of that name.
    InputError
        If the estimator has no such parameter.
    """
    made: Estimator = registry.make(ESTIMATORS, name, camera, **options)
    supply(made)
    return made


def supply(estimator: Estimator) -> None:
    """Give an estimator cached calibrations to take where it was given no files of them."""
    if isinstance(estimator, TakesCalibrations):
        # By name, for scenes are drawn by stages that no estimator may import.
        estimator.take_calibrations(import_module("fogsim.calibration.cached").CachedCalibrations(_load_lamps))


def _load_lamps(path: Path) -> Any:
    """Read a file of lamps, where a parameter names one."""
    return import_module("fogsim.scenario.parts.lamp_file").load_lamps(path)


__all__ = ["ESTIMATORS", "Estimator", "FoggyRoad", "OnnxGuest", "conformal_factor", "extinction_bound", "make"]
