"""The Canny–Deriche edge detector (Canny 1986, Deriche 1987), with edges that are not fog."""

from fogsim.vision.lines.deriche import derivatives
from fogsim.vision.lines.edges import EdgeDetector


class CannyDeriche(EdgeDetector):
    """Edge detector by Deriche's derivatives."""

    def __init__(self) -> None:
        super().__init__(derivatives)
