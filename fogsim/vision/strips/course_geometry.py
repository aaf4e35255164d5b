"""Strips of road that follow its course, and what the course leaves unsure of the extinction."""

import math
from dataclasses import replace

import numpy as np

from fogsim.core.linear_algebra import matrix_product
from fogsim.values.camera import Camera
from fogsim.vision.lines.road_course import RoadCourse
from fogsim.vision.strips import course_kernels
from fogsim.vision.strips.joint_fit import JointFit
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.strip_geometry import LANES, StripGeometry, laid_along

_MOST_ASIDE = 0.6
"""Deviation of a bent road's place up to which strips are on the road [m]."""


def course_geometry(geometry: StripGeometry, camera: Camera, course: RoadCourse) -> StripGeometry:
    """Lay strips along a road that bends, sags or crests.

    Rows are given by where they would be seen were the road the plane that touches it under the camera, about the
    course's horizon; so the joint fit takes them as it takes those of a plane.
    """
    shift, unit, height = course.row - camera.horizon_row, camera.row_distance, camera.mount_height
    seen = geometry.below - shift
    middle, top, bottom = (
        course_kernels.rows_on_plane(np.maximum(rows, 1e-3), course.sag, unit, height)
        for rows in (seen, seen - geometry.half, seen + geometry.half)
    )
    hidden = top <= 0.0
    middle = np.where(hidden, 1.0, middle)
    half = np.where(hidden, 0.5, 0.5 * (bottom - top))
    distance, sides = unit / middle, np.array(LANES)
    aside, unsure = course_kernels.sideways(distance, course.bend, course.bend_covariance)
    across, heading = camera.focal_length / distance, course.column
    left, right = (heading + across * (aside + side) for side in (sides[:, :1], sides[:, 1:]))
    right = np.where(hidden | (unsure > _MOST_ASIDE), left, right)
    placed = laid_along(geometry, left, right, camera)
    extent = np.where(hidden, 1.0, unit * 2.0 * half / np.maximum(middle**2 - half**2, 1e-9))
    return replace(placed, below=middle + shift, half=half, distance=distance, extent=extent)


def course_deviation(
    fit: JointFit, geometry: StripGeometry, camera: Camera, course: RoadCourse, prior: JointPrior, noise: float
) -> float:
    """Standard deviation of the extinction by what is not known of the course, beyond that by its horizon [1/m].

    Takes `noise` [linear grey levels].
    """
    # A fit with one of both neighbours does not say which.
    strips = len(fit.used) if len(fit.used) == len(geometry.path) else 1
    seen = course_kernels.Seen(
        used=fit.used[:strips],
        path=geometry.path[:strips],
        below=geometry.below,
        half=geometry.half,
        distance=geometry.distance,
        extent=geometry.extent,
        pixels=(geometry.right - geometry.left)[:strips] * geometry.rows,
        extinction=max(fit.extinction, 0.0),
        airlight=fit.airlight,
        road=fit.road,
        shift=fit.shift,
        noise=noise,
    )
    deviations = np.array([min(prior.below, prior.above), prior.shift_deviation, *course.sag_deviation])
    response = course_kernels.extinction_response(seen, deviations, camera.mount_height)
    total = float(matrix_product(response, matrix_product(course.covariance, response)))
    return math.sqrt(max(total - float(response[0] ** 2 * course.covariance[0, 0]), 0.0))
