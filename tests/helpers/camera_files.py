"""Camera files of which only what matters is written."""


def camera_yaml(
    size: tuple[int, int],
    focal: float,
    centre: tuple[float, float] | None = None,
    mount: float = 1.3,
    pitch: float = 0,
    response: str = "srgb",
) -> str:
    """Seven lines, six where no response is given; the principal point is in the middle unless given."""
    width, height = size
    u, v = centre or (0.5 * (width - 1), 0.5 * (height - 1))
    return (
        f"width: {width}\nheight: {height}\nfocal_length_px: {focal}\nprincipal_point_px: [{u}, {v}]\n"
        f"mount_height_m: {mount}\npitch_deg: {pitch}\n"
    ) + (f"response: {response}\n" if response else "")
