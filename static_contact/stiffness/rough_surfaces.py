"""Interface of randomly rough surfaces in series with the smooth bodies.

    K_rough = N / (gamma h_rms),   Kt_rough = K_rough Kt/Kn of a circular contact (2 (1 - nu)/(2 -
    nu) for equal nu)

The load falls off exponentially with the separation over the length gamma h_rms, whatever the
nominal area. Source: Campana, Persson & Mueser, J. Phys.: Condens. Matter 23 (2011) 085001. Valid
while the real contact is a small part of the nominal area.
"""

from dataclasses import dataclass

from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    Values,
    positive,
)
from tipdamp.static_contact.stiffness.flat_punch import ellipse_stiffness


@dataclass(frozen=True)
class Roughness:
    """h_rms : m, root mean square height of both surfaces combined; gamma : of order 0.5, by the
    roughness spectrum."""

    h_rms: float
    gamma: float

    def __post_init__(self) -> None:
        positive("h_rms", self.h_rms, "m")
        positive("gamma", self.gamma)


def rough_stiffness(pair: MaterialPair, force: Values, roughness: Roughness) -> Stiffness:
    """Tangent stiffness (N/m) of the rough interface alone under the normal force N (N)."""
    positive("force", force, "N")
    normal = force / (roughness.gamma * roughness.h_rms)
    circle = ellipse_stiffness(pair, 1.0, 1.0)
    tangential = normal * circle.along / circle.normal
    return Stiffness(normal, tangential, tangential)
