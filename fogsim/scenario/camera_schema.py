"""The block of a scenario file about the ego's camera."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fogsim.camera import Metering
from fogsim.scenario.section import Distance, Flag, Luminance, Number, PixelPlace, Pixels, Section, Share, Time, Whole
from fogsim.values import Response

_MOST_SAMPLES = 16_384
"""Columns and rows of samples that every OpenGL of today can draw."""


class CalibrationErrors(Section):
    """How the calibration that the vehicle assumes differs from the true one."""

    pitch_error_deg: Number = Field(default=0.0, ge=-10, le=10)
    """Assumed minus true pitch."""

    roll_error_deg: Number = Field(default=0.0, ge=-10, le=10)
    """Assumed minus true roll."""

    focal_length_error_percent: Number = Field(default=0.0, ge=-50, le=50)
    """Assumed over true focal length, minus 1."""

    mount_height_error_percent: Number = Field(default=0.0, ge=-50, le=50)
    """Assumed over true height of the mount, minus 1."""


class Exposure(Section):
    """How the camera sets its exposure."""

    mode: Literal["auto", "fixed"] | None = None
    """`auto`, or `fixed` at `saturation_luminance_cdpm2`; if not given, fixed where that is given, else auto."""

    metering: Metering = Metering.HIGHLIGHTS
    """What is held at the target: the 95th percentile of luminance (`highlights`) or its `log_average`."""

    target_percent: Annotated[Number, Field(ge=1, le=100)] | None = None
    """Share of saturation at which it is held; if not given, 65 for highlights and 18 for the log average."""

    time_constant_s: Time = 0.5
    """Time in which 63 % of a change of light is followed; 0 for the next frame."""

    brightest_cdpm2: Luminance = 100_000.0
    """Luminance that fills a pixel at the shortest exposure."""

    ungained_cdpm2: Luminance = 100.0
    """The same at the longest exposure; where that is too short the signal is amplified, and noisier."""

    darkest_cdpm2: Luminance = 4.0
    """The same at the longest exposure with the most gain."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.darkest_cdpm2 <= self.ungained_cdpm2 <= self.brightest_cdpm2:
            raise ValueError(
                "darkest_cdpm2, ungained_cdpm2 and brightest_cdpm2 must not decrease in this order, "
                f"got {self.darkest_cdpm2:g}, {self.ungained_cdpm2:g} and {self.brightest_cdpm2:g}"
            )
        return self


class MotionBlur(Section):
    """What moves while the shutter is open is smeared; how bright the picture is does not depend on it."""

    open_time_s: Annotated[Time, Field(le=0.5)] = 0.0
    """How long the shutter is open; by night cameras take 10 to 30 ms. 0 freezes what moves."""

    follows_exposure: Flag = False
    """Whether that is the longest time of the automatic exposure, which shortens it where there is more light."""

    instants: Whole = Field(default=5, ge=3, le=33)
    """Instants in that time that are drawn and averaged, an odd number: each costs as much as a frame."""

    @model_validator(mode="after")
    def _has_a_middle(self) -> Self:
        if self.instants % 2 == 0:
            raise ValueError(f"instants must be odd, so that one is in the middle, got {self.instants}")
        return self


class BodySection(Section):
    """How the vehicle's body moves the camera, unknown to the estimators."""

    pitch_deg_per_mps2: Number = Field(default=0.0, ge=0, le=2)
    """Pitch, nose down, for each m/s² of deceleration; cars have about 0.1 to 0.3."""

    time_constant_s: Time = 0.2
    """Lag with which the body follows."""


class StereoSection(Section):
    """A second camera like the first, to the right of it, and what the calibration of the pair has missed."""

    baseline_m: Annotated[Number, Field(ge=0.01, le=10)] = 0.5
    """Distance between the optical centres."""

    baseline_error_percent: Number = Field(default=0.0, ge=-50, le=50)
    """Stated over true baseline, minus 1."""

    yaw_error_deg: Number = Field(default=0.0, ge=-2, le=2)
    """How far its axis truly turns to the left of the first one's, where the calibration has them parallel."""

    pitch_error_deg: Number = Field(default=0.0, ge=-2, le=2)
    """The same downward."""

    roll_error_deg: Number = Field(default=0.0, ge=-2, le=2)
    """The same about the axis."""


class CameraSection(Section):
    """The ego's camera."""

    width: Whole = Field(default=640, ge=16, le=8192)
    """Columns of the image."""

    height: Whole = Field(default=480, ge=16, le=8192)
    """Rows of the image."""

    samples: Whole = Field(default=1, ge=1, le=3)
    """Samples a pixel side: 2 draws and fogs four for each pixel and averages their light, at four times the cost."""

    field_of_view_deg: Number = Field(default=58.0, ge=1, le=170)
    """Horizontal field of view; sets the focal length, whatever the size of the image."""

    focal_length_px: Pixels | None = None
    """Focal length, in place of the field of view."""

    principal_point_px: tuple[PixelPlace, PixelPlace] | None = None
    """Principal point [u0, v0]; if not given [width / 2, height / 2], half a pixel right of and below the middle."""

    mount_height_m: Annotated[Number, Field(ge=0.05, le=100)] | None = None
    """Height of the camera above the road; if not given, by the ego's body: 1.38 in a car."""

    setback_m: Annotated[Distance, Field(le=100)] | None = None
    """Distance of the camera behind the front bumper; if not given, by the ego's body: 1.7 in a car."""

    bonnet: Flag = False
    """Whether the own bonnet is in the picture, where the ego is a car."""

    pitch_deg: Number = Field(default=2.0, ge=-45, le=45)
    """Pitch; positive looks down."""

    roll_deg: Number = Field(default=0.0, ge=-45, le=45)
    """Roll; positive turns the image's right side down."""

    motion_blur: MotionBlur = MotionBlur()
    """What the shutter makes of what moves."""

    body: BodySection = BodySection()
    """How braking pitches the camera."""

    lens_shading: Share = 0.0
    """Darkening of the corners: 1 for the cos⁴ of a thin lens, 0 for none."""

    lens_glare: Share = 0.01
    """Share of the light of lamps that the lens scatters around them; 0 for none."""

    exposure: Exposure = Exposure()
    """How the exposure is set."""

    saturation_luminance_cdpm2: Luminance | None = None
    """Luminance that fills a pixel at a fixed exposure; if not given, the airlight fills 60 % of it."""

    full_well_e: Annotated[Number, Field(ge=1, le=1e9)] = 10_000.0
    """Electrons that fill a pixel; sets the photon noise."""

    read_noise_e: Annotated[Number, Field(ge=0, le=1e6)] = 5.0
    """Standard deviation of the read noise in electrons."""

    gained_read_noise_e: Annotated[Number, Field(ge=0, le=1e6)] | None = None
    """Read noise in electrons at very high gain, to which it falls; if not given, it is the same at every gain."""

    black_level_percent: Number = Field(default=0.0, ge=0, le=25)
    """Share of full scale at which the sensor reads no light; estimators know it. 0 cuts noise about the dark off."""

    response: Response = Response.SRGB
    """Curve from light to pixel values: `linear`, `gamma` (2.2) or `srgb`."""

    bits: Literal[8, 10, 12] = 8
    """Bit depth; images of 10 and 12 bits are uint16."""

    told: CalibrationErrors = CalibrationErrors()
    """Errors of the calibration that the estimators assume."""

    stereo: StereoSection | None = None
    """A second camera next to it; `{}` for one half a metre to the right. Each picture is drawn twice then."""

    @property
    def automatic(self) -> bool:
        """Whether the camera sets its own exposure."""
        mode = self.exposure.mode
        return self.saturation_luminance_cdpm2 is None if mode is None else mode == "auto"

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.gained_read_noise_e is not None and self.gained_read_noise_e > self.read_noise_e:
            raise ValueError(
                f"gained_read_noise_e must be at most read_noise_e, "
                f"got {self.gained_read_noise_e:g} and {self.read_noise_e:g}"
            )
        if self.exposure.mode == "auto" and self.saturation_luminance_cdpm2 is not None:
            raise ValueError(
                "saturation_luminance_cdpm2 is that of a fixed exposure, but exposure.mode is auto; leave one out"
            )
        if max(self.width, self.height) * self.samples > _MOST_SAMPLES:
            raise ValueError(
                f"width and height times samples must be at most {_MOST_SAMPLES}, "
                f"got {self.width} × {self.height} px with {self.samples} samples a pixel side"
            )
        return self
