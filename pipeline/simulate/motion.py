"""How the vehicle moves: an approach, a sweep past the dock, hovering, or a course steered by an estimator."""

from dockpose.checks import check_whole
from dockpose.simulate.parts import Part


class Motion(Part, frozen=True, kw_only=True, tag_field="kind"):
    """What all motions share.

    Parameters
    ----------
    frames, rate_hz : int and float, hertz
        Number of frames, and frames per second.
    drift_m, drift_deg : float, metres and degrees
        Standard deviations, over many sequences, of the drift and rotation by currents along and about each axis.
    drift_time_s : float, seconds
        Shortest period of the drift.

    Raises
    ------
    ValueError
        If a number is not finite or out of range.
    """

    frames: int = 100
    rate_hz: float = 10.0
    drift_m: float = 0.0
    drift_deg: float = 0.0
    drift_time_s: float = 4.0

    _above_0 = ("rate_hz", "drift_time_s")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole("frames", self.frames, least=1)


class Approach(Motion, frozen=True, kw_only=True, tag="approach"):
    """The distance ahead (z) falls evenly from ``start_m`` to ``end_m``; the dock keeps its place in the picture.

    Parameters
    ----------
    start_m, end_m : float, metres
        Distance in the first and the last frame, above 0.
    """

    start_m: float = 20.0
    end_m: float = 1.0

    _above_0 = (*Motion._above_0, "start_m", "end_m")


class Sweep(Motion, frozen=True, kw_only=True, tag="sweep"):
    """The dock passes at constant speed, from one side of its position in the scene to the other.

    Parameters
    ----------
    reach_m : float, metres
        How far it goes to either side.
    angle_deg : float, degrees
        Direction in the picture, from the x axis towards y.
    """

    reach_m: float = 1.0
    angle_deg: float = 0.0


class Hover(Motion, frozen=True, kw_only=True, tag="hover"):
    """The vehicle holds its position, apart from the currents."""

    drift_m: float = 0.03
    drift_deg: float = 2.0


class ClosedLoop(Motion, frozen=True, kw_only=True, tag="closed_loop"):
    """The vehicle moves onto the dock's axis as an estimator sees it, turns towards the dock, and closes in.

    Parameters
    ----------
    end_m : float, metres
        Distance at which it stops.
    speed_m_per_s, turn_deg_per_s : float, metres and degrees per second
        Top speed and top turn rate.
    """

    end_m: float = 1.0
    speed_m_per_s: float = 0.3
    turn_deg_per_s: float = 20.0

    _above_0 = (*Motion._above_0, "end_m")
