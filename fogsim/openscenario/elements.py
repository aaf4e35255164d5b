"""Elements and attributes of OpenSCENARIO XML 1.3 that are harmless or refused; all others are honoured.

Names are ``Element`` or ``Element@attribute``; an element's decision covers what it holds. `Node.check_read` refuses
what the format does not have, and what is honoured but was not read where it stands.
"""

from collections.abc import Mapping


def _by_name(reasons: Mapping[str, str]) -> dict[str, str]:
    return {name: reason for names, reason in reasons.items() for name in names.split()}


HARMLESS: Mapping[str, str] = _by_name(
    {
        "FileHeader@author FileHeader@date FileHeader@revMinor License": "who wrote the file, and when",
        "SceneGraphFile DomeImage DomeFile Vehicle@model3d": "a model or picture for drawing; FogSim draws its own",
        "Properties Property File CustomContent": "free-form properties, meant for another simulator",
        "Axles FrontAxle RearAxle AdditionalAxle Vehicle@mass": "lanes and accelerations say how a vehicle moves",
        "Performance@maxAccelerationRate Performance@maxDecelerationRate": "changes of speed have shapes of their own",
        "TrailerHitch TrailerCoupler": "nothing without a trailer",
        "Vehicle@role Pedestrian@role": "who has another role moves alike",
        "Pedestrian@mass Pedestrian@model Pedestrian@model3d MiscObject@mass MiscObject@model3d": "persons have "
        "figures of FogSim's, and everything else is a box",
        "ParameterDeclaration@parameterType VariableDeclaration@variableType": "a value is checked where it is used",
        "MonitorDeclarations MonitorDeclaration": "nothing may use them",
        "UsedArea": "the whole network is there",
        "Condition@name": "a label",
        "ObjectController Controller AssignControllerAction ActivateControllerAction": "programs of "
        "other simulators; the ego's driver and adviser are FogSim's, all others do what the storyboard orders",
        "BrakePercent BrakeForce AutomaticGear ManualGear Throttle@value Throttle@maxRate Brake@value Clutch@value "
        "Clutch@maxRate ParkingBrake@value SteeringWheel@value SteeringWheel@maxRate SteeringWheel@maxTorque "
        "Gear@number": "nothing while inactive",
        "TimeOfDay@animation": "in minutes the sun hardly moves",
        "Sun@azimuth": "daylight is the illuminance of the ground, without shadows",
        "SynchronizeAction@targetTolerance": "it arrives where and when it is to, within a step",
        "Wind": "even fog does not drift, and boxes of fog stand still",
        "Weather@atmosphericPressure Weather@temperature": "FogSim's light and fog do not depend on them",
        "WorldPosition@z WorldPosition@p WorldPosition@r RelativeWorldPosition@dz RelativeObjectPosition@dz "
        "Orientation@p Orientation@r": "these follow from the road",
        "SpeedActionDynamics@followingMode LaneChangeActionDynamics@followingMode": "dynamics are followed exactly",
        "DynamicConstraints": "FogSim's law of following has limits of its own",
        "Color ColorRgb ColorCmyk": "lamps have the colours that the law requires",
        "LightState@flashingOnDuration LightState@flashingOffDuration": "indicators flash as the law requires",
        "TimeHeadwayCondition@alongRoute TimeToCollisionCondition@alongRoute": "times are of distances along the road",
    }
)
"""Elements and attributes that could not change a run, and why."""

REFUSED: Mapping[str, str] = _by_name(
    {
        "OpenScenario": "the root is written OpenSCENARIO",
        "ExternalObjectReference EntitySelection Members ScenarioObjectTemplate EntityDistribution "
        "EntityDistributionEntry": "entities are vehicles, persons and things that the file describes one by one",
        "RandomRouteAction": "who has no route goes straight on",
        "FromRoadCoordinates": "a place on a route has a lane; write FromLaneCoordinates",
        "TrajectoryPosition Clothoid ClothoidSpline ClothoidSplineSegment PositionStart Nurbs ControlPoint Knot "
        "FollowTrajectoryAction@initialDistanceOffset": "trajectories are polylines, from their first vertex on",
        "TargetDistanceSteadyState TargetTimeSteadyState": "the final speed is reached at the target",
        "LateralDistanceAction": "where vehicles are in their lanes does not depend on others",
        "VisibilityAction SensorReferenceSet SensorReference": "everything can be seen that the fog does not hide",
        "AnimationAction AnimationType AnimationState AnimationFile ComponentAnimation VehicleComponent "
        "UserDefinedComponent PedestrianAnimation PedestrianGesture UserDefinedAnimation": "nothing moves on a body",
        "UserDefinedLight LightState@luminousIntensity": "lamps shine as their type does",
        "Trailer@name TrailerAction ConnectTrailerAction DisconnectTrailerAction": "vehicles have no trailers",
        "InfrastructureAction TrafficSignalAction TrafficSignalControllerAction TrafficSignalStateAction "
        "TrafficSignalController Phase TrafficSignalState TrafficSignalGroupState TrafficSignalCondition "
        "TrafficSignalControllerCondition": "lights follow the network",
        "TrafficAction TrafficSourceAction TrafficSinkAction TrafficSwarmAction TrafficAreaAction TrafficStopAction "
        "CentralObject InitialSpeedRange TrafficDefinition TrafficDistribution TrafficDistributionEntry TrafficArea "
        "RoadRange RoadCursor Lane Polygon VehicleCategoryDistribution VehicleCategoryDistributionEntry "
        "VehicleRoleDistribution VehicleRoleDistributionEntry ControllerDistribution ControllerDistributionEntry "
        "DirectionOfTravelDistribution": "there is no traffic but the entities",
        "ModifyAction Rule AddValue MultiplyByValue SetMonitorAction": "values are set, not changed by others",
        "UserDefinedAction CustomCommandAction UserDefinedValueCondition UserDefinedDistribution": "its meaning is "
        "another simulator's",
        "GeoPosition": "places are by lane, by road, in the map's metres, or by an entity",
        "OffroadCondition AngleCondition RelativeAngleCondition RelativeClearanceCondition "
        "RelativeLaneRange TimeOfDayCondition": "FogSim has no such condition",
        "DistanceCondition@routingAlgorithm RelativeDistanceCondition@routingAlgorithm "
        "TimeHeadwayCondition@routingAlgorithm TimeToCollisionCondition@routingAlgorithm": "distances are along the "
        "ego's route",
        "ByType@objectType": "name the entities",
    }
)
"""Elements and attributes that change the meaning of a file and that FogSim does not do, and what it does instead."""
