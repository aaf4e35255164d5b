"""Draw docs/pictures/night_fog.jpg: ``python docs/night_sheet.py``. Four visibilities by five kinds of light."""

from contact_sheet import HIGH, NIGHT, fog
from staging import LIT, PICTURES, Shot, Vehicle, photograph, sheet

from fogsim.values import Lamp

VISIBILITIES = (500, 200, 100, 50)
SIZE = (400, 300)
CAR = Vehicle("car", 35.0)
ONCOMING = tuple(Vehicle("car", 40.0 + 45.0 * n, 11.5 + 3.75 * (n % 2), LIT, oncoming=True) for n in range(4))
REAR_FOG = Vehicle("car", 35.0, lamps=LIT | Lamp.REAR_FOG)


def row(visibility: int) -> tuple[Shot, ...]:
    """Five kinds of light in one fog."""
    settings, name = (NIGHT, fog(str(visibility))), f"V_met {visibility} m"
    return (
        Shot(f"{name}, low beam", settings, vehicles=(CAR,)),
        Shot(f"{name}, high beam", settings, vehicles=(CAR,), lamps=HIGH),
        Shot(f"{name}, high beam, oncoming cars", settings, vehicles=(CAR, *ONCOMING), lamps=HIGH),
        Shot(f"{name}, low beam, street lamps", (*settings, "street_lamps=true"), vehicles=(CAR,)),
        Shot(f"{name}, low beam, rear fog lamp ahead", settings, vehicles=(REAR_FOG,)),
    )


def main() -> None:
    """Draw and save."""
    shots = [shot for visibility in VISIBILITIES for shot in row(visibility)]
    pictures = [(shot.title, photograph(shot, "cpu", SIZE).image) for shot in shots]
    sheet(pictures, 5).save(PICTURES / "night_fog.jpg", quality=85)


if __name__ == "__main__":
    main()
