"""The camera's image as it stands in the video, its right half with the contrast that the fog has taken."""

from PIL import Image, ImageDraw

from fogsim.recorders.panel.camera_picture import HEIGHT, WIDTH, draw_camera_picture, scale_image
from fogsim.recorders.style import BELIEF, GROUND, font
from fogsim.restoration import restore_contrast
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Frame, Step
from fogsim.values.camera_response import eight_bit

_FOGGY = 500.0
"""Visibility from which on fog takes too little contrast to be undone [m]."""

BRIGHT = 10.0
"""Illuminance below which lamps light the fog, which is not what is undone [lx]."""


def draw_restored_picture(step: Step) -> Image.Image:
    """Draw the camera's image, and over its right half what contrast restoration by the belief makes of it.

    Where no fog is believed, by night, and of frames without a calibration it is the camera's image alone.
    """
    picture, frame = draw_camera_picture(step), step.observation.frame
    light = step.observation.light
    believed = step.belief.visibility
    if not isinstance(frame, Frame) or believed >= _FOGGY or (light is not None and light.illuminance < BRIGHT):
        return picture
    restored = restore_contrast(frame.image, frame.camera, OPTICAL_DEPTH_AT_VISIBILITY / believed, tone_map=True)
    scaled = scale_image(eight_bit(restored.image, frame.camera.bits), WIDTH, HEIGHT)
    left, top, middle = (WIDTH - scaled.width) // 2, (HEIGHT - scaled.height) // 2, scaled.width // 2
    picture.paste(scaled.crop((middle, 0, scaled.width, scaled.height)), (left + middle, top))
    draw = ImageDraw.Draw(picture)
    draw.line([(left + middle, top), (left + middle, top + scaled.height)], fill=BELIEF, width=1)
    label = f"contrast restored for {believed:.0f} m"
    draw.text((left + middle + 8, top + 16), label, fill=BELIEF, font=font(11), stroke_width=2, stroke_fill=GROUND)
    return picture
