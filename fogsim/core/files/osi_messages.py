"""Messages of ASAM OSI: its library, which is an extra, their headers, and their framing in traces and on sockets."""

import struct
from typing import Any

from fogsim.errors import MissingDependencyError

LENGTH = struct.Struct("<L")
"""Length of a message in bytes, before the message: 4 bytes, little-endian."""

_NANOSECONDS = 1_000_000_000


def osi_library(who: str) -> Any:
    """The package ``osi3`` with the modules that FogSim uses; `who` needs it."""
    try:
        import osi3  # noqa: PLC0415 - an extra
        from osi3 import (  # noqa: F401, PLC0415 - so that the package has them
            osi_environment_pb2,
            osi_groundtruth_pb2,
            osi_motionrequest_pb2,
            osi_object_pb2,
            osi_sensordata_pb2,
            osi_trafficlight_pb2,
            osi_trafficsign_pb2,
        )
    except ImportError as error:
        raise MissingDependencyError(f"{who} needs osi-python ({error}): pip install 'fogsim[osi]'") from error
    return osi3


def stamp(message: Any, time: float) -> None:
    """Set version and timestamp of a message (`time` [s])."""
    message.version.version_major, message.version.version_minor, message.version.version_patch = 3, 8, 0
    message.timestamp.seconds, message.timestamp.nanos = divmod(round(time * _NANOSECONDS), _NANOSECONDS)


def framed(message: Any) -> bytes:
    """A message after its length; the same message gives the same bytes."""
    content: bytes = message.SerializeToString(deterministic=True)
    return LENGTH.pack(len(content)) + content
