"""The differential drive of the paper's section 2.3: wheel speeds to body twist and back."""

from dataclasses import dataclass

from numba import njit

from swarm.geometry import Twist


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two driven wheels on one axle."""

    track_width: float  # m, L: between the wheels' contact points

    def twist(self, left: float, right: float) -> Twist:
        """Return the body twist of two rim speeds [m/s]: v = (v_r + v_l)/2, w = (v_r - v_l)/L."""
        return Twist((right + left) / 2, (right - left) / self.track_width)

    def rim_speeds(self, twist: Twist) -> tuple[float, float]:
        """Return the rim speeds (left, right) [m/s] that give a body twist: the inverse of ``twist``."""
        half = twist.angular * self.track_width / 2
        return twist.linear - half, twist.linear + half


def ramped(
    wheels: tuple[float, float], wanted: tuple[float, float], fastest: float, most: float
) -> tuple[float, float]:
    """Return rim speeds [m/s] one control step later: ``ramp`` towards the wanted ones, of which none is faster."""
    left, right = (max(-fastest, min(fastest, speed)) for speed in wanted)
    return ramp(wheels[0], left, most), ramp(wheels[1], right, most)


@njit("f8(f8, f8, f8)", cache=True)
def ramp(current: float, wanted: float, most: float) -> float:
    """Return a rim speed [m/s] one control step later: it approaches ``wanted`` by at most ``most`` [m/s]."""
    return min(current + most, max(current - most, wanted))
