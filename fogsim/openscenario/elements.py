"""What becomes of each element and attribute of OpenSCENARIO XML 1.3: honoured, harmless or refused.

Names are ``Element`` or ``Element@attribute``; an element's decision covers what it holds, unless it is honoured.
`Findings.look_for_unread` refuses what has no decision, and what is honoured but was not read where it stands.
"""

from collections.abc import Mapping


def _by_name(reasons: Mapping[str, str]) -> dict[str, str]:
    return {name: reason for names, reason in reasons.items() for name in names.split()}


_HONOURED = """
OpenSCENARIO FileHeader@description,revMajor ParameterDeclarations ParameterDeclaration@name,value ConstraintGroup
ValueConstraint@rule,value ParameterAssignments ParameterAssignment@parameterRef,value
CatalogLocations VehicleCatalog ControllerCatalog EnvironmentCatalog ManeuverCatalog Directory@path
Catalog@name CatalogReference@catalogName,entryName
RoadNetwork LogicFile@filepath TrafficSignals
Entities ScenarioObject@name Vehicle@name,vehicleCategory Performance@maxAcceleration,maxDeceleration,maxSpeed
BoundingBox Center@x,y,z Dimensions@height,length,width Trailer TrailerRef@entityRef
Storyboard Init Actions Private@entityRef Story@name Act@name ManeuverGroup@maximumExecutionCount,name
Actors@selectTriggeringEntities EntityRef@entityRef Maneuver@name Event@maximumExecutionCount,name,priority Action@name
EntityAction@entityRef AddEntityAction DeleteEntityAction
GlobalAction PrivateAction TeleportAction Position LongitudinalAction LateralAction AppearanceAction
EnvironmentAction Environment@name TimeOfDay@dateTime Weather@cloudState,fractionalCloudCover Fog@visualRange
Sun@elevation,illuminance,intensity Precipitation@intensity,precipitationIntensity,precipitationType
RoadCondition@frictionScaleFactor,wetness
SpeedAction SpeedActionDynamics@dynamicsDimension,dynamicsShape,value SpeedActionTarget AbsoluteTargetSpeed@value
RelativeTargetSpeed@continuous,entityRef,speedTargetValueType,value
LongitudinalDistanceAction@continuous,coordinateSystem,displacement,distance,entityRef,freespace,timeGap
LaneOffsetAction@continuous LaneOffsetActionDynamics@dynamicsShape,maxLateralAcc LaneOffsetTarget
AbsoluteTargetLaneOffset@value RelativeTargetLaneOffset@entityRef,value
SpeedProfileAction@entityRef,followingMode SpeedProfileEntry@speed,time
SynchronizeAction@masterEntityRef,targetToleranceMaster TargetPosition TargetPositionMaster FinalSpeed
AbsoluteSpeed@value RelativeSpeedToMaster@speedTargetValueType,value
FollowTrajectoryAction Trajectory@closed,name TrajectoryRef TrajectoryFollowingMode@followingMode Shape Polyline
Vertex@time TimeReference None Timing@domainAbsoluteRelative,offset,scale TrajectoryCatalog
ParameterAction@parameterRef VariableAction@variableRef SetAction@value VariableDeclarations
VariableDeclaration@name,value
ParameterCondition@parameterRef,rule,value VariableCondition@rule,value,variableRef
LaneChangeAction@targetLaneOffset LaneChangeActionDynamics@dynamicsDimension,dynamicsShape,value LaneChangeTarget
AbsoluteTargetLane@value RelativeTargetLane@entityRef,value
LightStateAction@transitionTime LightType VehicleLight@vehicleLightType LightState@mode
ControllerAction OverrideControllerValueAction Throttle@active Brake@active Clutch@active ParkingBrake@active
SteeringWheel@active Gear@active
WorldPosition@h,x,y LanePosition@laneId,offset,roadId,s RoadPosition@roadId,s,t Orientation@h,type
RelativeLanePosition@dLane,ds,dsLane,entityRef,offset RelativeWorldPosition@dx,dy,entityRef
RelativeObjectPosition@dx,dy,entityRef RelativeRoadPosition@ds,dt,entityRef
StartTrigger StopTrigger ConditionGroup Condition@conditionEdge,delay ByValueCondition ByEntityCondition EntityCondition
TriggeringEntities@triggeringEntitiesRule SimulationTimeCondition@rule,value
StoryboardElementStateCondition@state,storyboardElementRef,storyboardElementType
SpeedCondition@direction,rule,value AccelerationCondition@direction,rule,value StandStillCondition@duration
RelativeSpeedCondition@direction,entityRef,rule,value TraveledDistanceCondition@value
RelativeDistanceCondition@coordinateSystem,entityRef,freespace,relativeDistanceType,rule,value
DistanceCondition@alongRoute,coordinateSystem,freespace,relativeDistanceType,rule,value ReachPositionCondition@tolerance
TimeHeadwayCondition@coordinateSystem,entityRef,freespace,relativeDistanceType,rule,value
TimeToCollisionCondition@coordinateSystem,freespace,relativeDistanceType,rule,value TimeToCollisionConditionTarget
CollisionCondition ByType@type EndOfRoadCondition@duration
RoutingAction AssignRouteAction AcquirePositionAction Route@closed,name Waypoint@routeStrategy RouteCatalog RouteRef
RoutePosition InRoutePosition FromCurrentEntity@entityRef FromLaneCoordinates@laneId,laneOffset,pathS
Pedestrian@name,pedestrianCategory MiscObject@miscObjectCategory,name PedestrianCatalog MiscObjectCatalog
ParameterValueDistribution ScenarioFile@filepath Deterministic DeterministicMultiParameterDistribution
DeterministicSingleParameterDistribution@parameterName DistributionRange@stepWidth DistributionSet
Element@value,weight ValueSetDistribution ParameterValueSet Range@lowerLimit,upperLimit
Stochastic@numberOfTestRuns,randomSeed StochasticDistribution@parameterName NormalDistribution@expectedValue,variance
LogNormalDistribution@expectedValue,variance UniformDistribution PoissonDistribution@expectedValue Histogram
Bin@weight ProbabilityDistributionSet
"""

HONOURED: Mapping[str, tuple[str, ...]] = {
    name: tuple(filter(None, attributes.split(",")))
    for name, _, attributes in (word.partition("@") for word in _HONOURED.split())
}
"""Elements that are read, with their attributes that are."""

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
