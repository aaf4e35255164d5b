"""Options of commands that read images, and where those come from."""

from typing import TYPE_CHECKING, Annotated

import typer

from fogsim.cli.printing import print_remarks

if TYPE_CHECKING:
    from fogsim.offline import Source

Images = Annotated[
    list[str],
    typer.Argument(metavar="IMAGES|VIDEO", help="Image files, folders, patterns like 'a/*.png', or a video."),
]
IsSequence = Annotated[
    bool | None,
    typer.Option(
        "--sequence/--stills",
        help="Read images as a sequence, or each by itself. Default: by their names and EXIF times.",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(min=1e-6, max=1e6, help="Images per second of a sequence. Default: by their EXIF times, or 10."),
]


def found_source(images: list[str], sequence: bool | None, rate: float | None) -> "Source":
    """Images from a command line; what is assumed of them or left out is printed."""
    from fogsim.offline import ImageFiles, find_source

    source = find_source(images, sequence=sequence, rate=rate)
    if isinstance(source, ImageFiles):
        print_remarks("warning", source.remarks)
    return source
