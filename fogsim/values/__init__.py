"""The plain frozen values that the stages of FogSim hand to one another."""

from fogsim.values.belief import Belief
from fogsim.values.camera import Camera, CameraPose, Response
from fogsim.values.command import Command, Display, EgoControl, SpeedAdvice, Stretch, StretchAdvice
from fogsim.values.estimate import Estimate, FogCategory, SignLook, fog_category
from fogsim.values.fault import Fault, RunningFault
from fogsim.values.fog import FogBank, FogChange, FogField, FogPatches, FogShelter
from fogsim.values.image import Frame, View
from fogsim.values.light import Beam, HeadLamp, Lamp, LampLobes, Lights, LightSources, SignalLight, StreetLighting
from fogsim.values.observation import LeadMeasurement, Observation, SignSighting
from fogsim.values.road import (
    Lane,
    LaneEnd,
    LaneKind,
    LaneMarking,
    PavedArea,
    RoadNetwork,
    Sign,
    SignalHead,
    SignMap,
    Structure,
    StructureKind,
)
from fogsim.values.scene import Batch, Mesh, Scene, Surface
from fogsim.values.script import Begun
from fogsim.values.step import Ending, RoadSection, Step, TrafficStep, Truth
from fogsim.values.traffic import (
    Collision,
    Leader,
    NetworkSnapshot,
    PersonState,
    SignalAhead,
    SignalColour,
    SignalState,
    TrafficSnapshot,
    TrafficState,
)
from fogsim.values.unplayed import NOTHING_UNPLAYED, Reason, Unplayed, UnplayedEvent

__all__ = [
    "NOTHING_UNPLAYED",
    "Batch",
    "Beam",
    "Begun",
    "Belief",
    "Camera",
    "CameraPose",
    "Collision",
    "Command",
    "Display",
    "EgoControl",
    "Ending",
    "Estimate",
    "Fault",
    "FogBank",
    "FogCategory",
    "FogChange",
    "FogField",
    "FogPatches",
    "FogShelter",
    "Frame",
    "HeadLamp",
    "Lamp",
    "LampLobes",
    "Lane",
    "LaneEnd",
    "LaneKind",
    "LaneMarking",
    "LeadMeasurement",
    "Leader",
    "LightSources",
    "Lights",
    "Mesh",
    "NetworkSnapshot",
    "Observation",
    "PavedArea",
    "PersonState",
    "Reason",
    "Response",
    "RoadNetwork",
    "RoadSection",
    "RunningFault",
    "Scene",
    "Sign",
    "SignLook",
    "SignMap",
    "SignSighting",
    "SignalAhead",
    "SignalColour",
    "SignalHead",
    "SignalLight",
    "SignalState",
    "SpeedAdvice",
    "Step",
    "StreetLighting",
    "Stretch",
    "StretchAdvice",
    "Structure",
    "StructureKind",
    "Surface",
    "TrafficSnapshot",
    "TrafficState",
    "TrafficStep",
    "Truth",
    "Unplayed",
    "UnplayedEvent",
    "View",
    "fog_category",
]
