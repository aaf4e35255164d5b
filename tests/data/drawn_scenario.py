"""A scenario with a space, which runs without frames and in a second."""

SCENARIO = """
name: drawn
duration: 1 s
road: {template: motorway, length: 1 km}
actors: {ego: {position: 50 m, speed: $speed}}
fog: {visibility: $fog}
renderer: none
sut: {estimators: []}
expect: {safe: {always: ego.speed > 1 km/h, requirement: [SYS-1, SYS 2]}}
space:
  fog: {lognormal: [100 m, 1], at_least: 20 m, at_most: 1000 m}
  speed: {uniform: [50 km/h, 120 km/h]}
  run: seeds
"""
