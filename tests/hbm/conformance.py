"""The contact laws on which the tests of hbm/laws run."""

import importlib.util
from dataclasses import MISSING, dataclass, fields
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm import fourier
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.laws import SHIPPED, ContactLaw, Contacts, IsotropicFriction, MixedLaw
from tipdamp.hbm.model import ReducedModel

OWN_LAWS = Path(__file__).parents[2] / "docs" / "studies" / "own_law"


def own_law(name):
    """The module of a documented example, out of its own file."""
    spec = importlib.util.spec_from_file_location(name, OWN_LAWS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class SteppedFriction(IsotropicFriction):
    """Coupled friction by its step alone, sample by sample: slow."""

    harmonics, default_samples = ContactLaw.harmonics, ContactLaw.default_samples
    by_friction, by_stiffness = ContactLaw.by_friction, ContactLaw.by_stiffness


@dataclass(frozen=True)
class Case:
    """law; normal: kind of normal load, 'preload', 'variable' or ''; cycles until the plain loop
    repeats.

    friction : 'together' or 'each' - |T| of the tangents stays within mu N; 'creep' - it does, but
        there is no slider; '' - there is no friction
    order : None where the result does not depend on the samples, else the order in which it
    converges
    """

    law: object
    normal: str = ""
    friction: str = ""
    cycles: int = 1
    order: float | None = None


def required(law):
    """{parameter: 1.0} of those without which the law cannot be made."""
    return {
        f.name: 1.0
        for f in fields(law)
        if f.init and f.default is MISSING and f.default_factory is MISSING
    }


ABOUT = {
    "Jenkins1D": ("preload", "each"),
    "DryFriction1T": ("variable", "each"),
    "DryFriction2T": ("variable", "each"),
    "UnilateralSpring": ("variable",),
    "IsotropicFriction": ("variable", "together", 60),
}
LAWS = (
    *(Case(law(**required(law)), *ABOUT.get(name, ())) for name, law in SHIPPED.items()),
    Case(own_law("dahl").Dahl(), "preload", "creep", cycles=40, order=2),
)


def mixed(P):
    """A mixture of all laws."""
    return MixedLaw(tuple(case.law for case in LAWS), np.arange(P) % len(LAWS))


def random_case(law, P=30, H=5, seed=0):
    """(x (P, nd, nh), contacts, generator): amplitudes at which contacts stick, slip and lift."""
    rng = np.random.default_rng(seed)
    decay = (1 + np.r_[0, np.repeat(np.arange(1, H + 1), 2)]) ** 2
    x = rng.normal(size=(P, len(law.components), 2 * H + 1)) / decay
    contacts = Contacts(
        kn=rng.uniform(0.5, 2, P),
        kt=rng.uniform(0.5, 2, P),
        mu=rng.uniform(0.1, 0.8, P),
        preload=rng.uniform(-0.3, 1, P),
    )
    return x, contacts, rng


def located_slider(kt, kn, mu, preload, u, un, start, steps=720):
    """Harmonics (nh,) of -kt w of one slider, and of the opened normal spring: events by brentq,
    integrals by Gauss."""
    H = fourier.n_real(0) and (len(u) - 1) // 2
    point, weight = np.polynomial.legendre.leggauss(10)

    def at(c, t):
        return float(fourier.basis(np.array([t]), H)[0] @ c)

    def rate(c, t):
        return float(fourier.basis_rate(np.array([t]), H)[0] @ c)

    N = kn * un
    N[0] += preload
    low, high = u - mu / max(kt, 1e-300) * N, u + mu / max(kt, 1e-300) * N
    tangent, normal = np.zeros(2 * H + 1), np.zeros(2 * H + 1)
    w = at(u, 0.0) if start == "zero_force" else 0.0
    state = "stick" if at(N, 0.0) > 0 else "open"
    w = min(max(w, at(low, 0.0)), at(high, 0.0)) if state == "stick" else w
    following = {"forward": low, "backward": high, "open": u}
    for k in range(2 * steps):
        t, end = 2 * np.pi * k / steps, 2 * np.pi * (k + 1) / steps
        while t < end:
            events = [(end, state)]

            def watch(f, new, t=t, end=end, events=events):
                """The instant at which f turns positive."""
                if f(end) > 0:
                    events.append(
                        (brentq(f, t, end, xtol=1e-15, rtol=1e-15) if f(t) < 0 else t, new)
                    )

            if state == "open":
                watch(lambda s: at(N, s), "closes")
            else:
                watch(lambda s: -at(N, s), "open")
            if state == "stick":
                watch(lambda s, w=w: at(low, s) - w, "forward")
                watch(lambda s, w=w: w - at(high, s), "backward")
            if state == "forward":
                watch(lambda s: -rate(low, s), "stick")
            if state == "backward":
                watch(lambda s: rate(high, s), "stick")
            until, new = min(events, key=lambda e: e[0])
            if k >= steps and until > t:
                s = t + 0.5 * (until - t) * (1 + point)
                e = fourier.basis(s, H)
                scale = np.r_[0.5, np.ones(2 * H)] * 0.5 * (until - t) / np.pi
                tangent += scale * (
                    (weight * -kt * (w if state == "stick" else e @ following[state])) @ e
                )
                normal += scale * ((weight * (-(e @ N) if state == "open" else 0.0)) @ e)
            if state in following:
                w = at(following[state], until)
            if new == "closes":
                new = (
                    "forward"
                    if rate(low, until) > 0
                    else "backward"
                    if rate(high, until) < 0
                    else "stick"
                )
            t, state = until, new
    return tangent, normal


def one_dof(law):
    """(model, table of one pair to the ground, force row): a point of three dofs, 1 kg on springs
    of 100 N/m."""
    model = ReducedModel.from_matrices(
        np.eye(3),
        100 * np.diag([1.0, 1.1, 1.2]),
        body="mass",
        node=[1, 1, 1],
        direction=["x", "y", "z"],
        position=np.zeros((3, 3)),
    )
    pairs = ContactTable(
        ["left"],
        [0],
        [0],
        ["ground"],
        [1],
        ["mass"],
        [1],
        np.zeros((1, 3)),
        [np.eye(3)],
        gap=[0.0],
        kn=[50.0],
        kt=[40.0],
        mu=[0.5],
        preload=[2.0],
        weight=[1.0],
    )
    return model, pairs, np.array([1.0, 0.7j, 1.5])
