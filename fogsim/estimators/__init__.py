"""Visibility estimators, one method a module, in one registry: published ones and three of this project's own."""

from collections.abc import Callable
from importlib import import_module

from fogsim import registry
from fogsim.estimators.cramer_rao import FoggyRoad, extinction_bound
from fogsim.estimators.huang2015 import Huang2015
from fogsim.estimators.huang2015_lead import Huang2015Lead
from fogsim.estimators.huang2015_rough import Huang2015Rough
from fogsim.estimators.joint_road import JointRoad
from fogsim.estimators.lead_contrast import LeadContrast
from fogsim.estimators.learned import OnnxGuest, conformal_factor, onnx_guest
from fogsim.estimators.negru2013 import Negru2013
from fogsim.estimators.night.gallen2014 import Gallen2014, Gallen2014Halo
from fogsim.estimators.night.gallen2014_veil import Gallen2014Veil
from fogsim.estimators.night.night_road import NightRoad
from fogsim.estimators.other_sensors.gabb2014 import Gabb2014
from fogsim.estimators.other_sensors.hautiere2006_stereo import Hautiere2006Stereo
from fogsim.estimators.other_sensors.scatterometer import Scatterometer
from fogsim.estimators.protocol import Estimator, TakesCalibrations
from fogsim.estimators.signs.belaroussi2015 import Belaroussi2015
from fogsim.estimators.signs.sign_contrast import SignContrast
from fogsim.estimators.zhu2015 import Zhu2015
from fogsim.parameters import checked_parameters
from fogsim.registry import Registry
from fogsim.values.camera import Camera


def _refusing(estimator: type[Estimator]) -> type[Estimator]:
    """An estimator whose `update` refuses what is not an `Observation`."""
    estimator.update = checked_parameters(estimator.update)  # type: ignore[method-assign]
    return estimator


ESTIMATORS: Registry[Callable[..., Estimator]] = Registry(
    "estimator",
    {
        "negru2013": _refusing(Negru2013),
        "zhu2015": _refusing(Zhu2015),
        "huang2015": _refusing(Huang2015),
        "huang2015_rough": _refusing(Huang2015Rough),
        "huang2015_lead": _refusing(Huang2015Lead),
        "belaroussi2015": _refusing(Belaroussi2015),
        "joint_road": _refusing(JointRoad),
        "lead_contrast": _refusing(LeadContrast),
        "sign_contrast": _refusing(SignContrast),
        "gallen2014_veil": _refusing(Gallen2014Veil),
        "night_road": _refusing(NightRoad),
        "hautiere2006_stereo": _refusing(Hautiere2006Stereo),
        "gallen2014": _refusing(Gallen2014),
        "gallen2014_halo": _refusing(Gallen2014Halo),
        "gabb2014": _refusing(Gabb2014),
        "scatterometer": _refusing(Scatterometer),
    },
    group="fogsim.estimators",
    methods=("update", "reset"),
    files={"onnx": onnx_guest},
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
    if isinstance(made, TakesCalibrations):
        # By name, for scenes are drawn by stages that no estimator may import.
        import_module("fogsim.scenario.parts.methods").supply(made)
    return made


__all__ = ["ESTIMATORS", "Estimator", "FoggyRoad", "OnnxGuest", "conformal_factor", "extinction_bound", "make"]
