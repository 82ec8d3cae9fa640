"""Bad input through forced_response: one line that names what came and what is allowed.

Nothing heavy may have started: the modes of the stuck system and the continuation are taken away
while these run. Then the input whose right answer is known: no force, no friction, a band that runs
down. Studies: tests/tipdamp.
"""

import warnings
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance import problem as problems
from tipdamp.hbm.balance import receptance as linear
from tipdamp.hbm.balance import residual, restraint
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.receptance import free_receptance
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.named_motion import describe_motion
from tipdamp.hbm.laws import (
    ContactLaw,
    Contacts,
    CubicSpring,
    DryFriction2T,
    Jenkins1D,
    UnilateralSpring,
)
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band, forced_response

MODEL, PAIRS, TIP = small_rig(stations=3)


@dataclass(frozen=True)
class Flat(ContactLaw):
    """A law of one's own in which one shape is wrong."""

    components: ClassVar[tuple] = ("t1", "n")
    states: ClassVar[int] = 1

    wrong: str = ""

    def stuck_stiffness(self, pairs):
        return pairs.kt if self.wrong == "stiffness" else np.stack([pairs.kt, pairs.kn], axis=1)

    def initial_state(self, u, start, pairs):
        return u if self.wrong == "state" else u[:, :1]

    def step(self, motion, state, pairs):
        return motion.u[:, 0] if self.wrong == "force" else motion.u, state


def curve(**changes):
    """forced_response on the small rig with changes: of M, K, C, of columns of the table, or of the
    call."""
    matrices = {k: changes.pop(k) for k in "MKC" if k in changes}
    columns = {
        k: changes.pop(k) for k in ("kn", "kt", "mu", "preload", "weight", "gap") if k in changes
    }
    model = changes.pop("model", MODEL)
    if matrices:
        table = {k: getattr(MODEL, k) for k in ("body", "node", "direction", "position")}
        model = ReducedModel.from_matrices(**({"M": MODEL.M, "K": MODEL.K} | matrices), **table)
    pairs = changes.pop("pairs", PAIRS)
    if columns:
        pairs = replace(pairs, **columns)
    call = dict(
        law=DryFriction2T(),
        forcing=8 * TIP,
        band=(1100, 1500),
        harmonics=1,
        damping_ratio=0.02,
        outputs={"tip": TIP},
    )
    return forced_response(model, pairs, **(call | changes))


def settings(**changed):
    return replace(DEFAULT, **changed)


def with_entry(matrix, i, j, value):
    changed = matrix.copy()
    changed[i, j] = value
    return changed


def changed_pair(column, value):
    values = getattr(PAIRS, column).copy()
    values[1] = value
    return {column: values}


def unheld():
    """The damper on one pair only can move freely whatever sticks."""
    return {"pairs": PAIRS.select(np.arange(len(PAIRS)) == 0)}


REFUSED = {
    "H negative": ({"harmonics": -1}, r"harmonics = -1: must be a whole number between 0 and 200"),
    "H not whole": (
        {"harmonics": 2.5},
        r"harmonics = 2\.5: must be a whole number between 0 and 200",
    ),
    "H a text": ({"harmonics": "5"}, r"harmonics = '5': must be a whole number"),
    "H true": ({"harmonics": True}, r"harmonics = True: must be a whole number"),
    "H absurd": (
        {"harmonics": 100000},
        r"harmonics = 100000: must be a whole number between 0 and 200",
    ),
    "H below the forcing": ({"harmonics": 0}, r"harmonic 1: harmonics = 0 keeps orders 0\.\.0"),
    "NaN in K": (
        lambda: {"K": with_entry(MODEL.K, 3, 5, np.nan)},
        r"K\[3, 5\] is nan: every entry must be finite",
    ),
    "NaN in M": (
        lambda: {"M": with_entry(MODEL.M, 2, 2, np.nan)},
        r"M\[2, 2\] is nan: every entry must be finite",
    ),
    "infinite C": (lambda: {"C": with_entry(0 * MODEL.M, 2, 2, np.inf)}, r"C\[2, 2\] is inf"),
    "K unsymmetric": (
        lambda: {"K": with_entry(MODEL.K, 0, 1, 1e6)},
        r"K is not symmetric: .*allowed 1e-10",
    ),
    "M unsymmetric": (
        lambda: {"M": with_entry(MODEL.M, 0, 1, 1e-3)},
        r"M is not symmetric: .*allowed 1e-10",
    ),
    "K not square": (lambda: {"K": MODEL.K[:, :-1]}, r"K must be a square matrix, got shape"),
    "M of another size": (
        lambda: {"M": MODEL.M[:-1, :-1]},
        r"M is \(\d+, \d+\).*all must have the same size",
    ),
    "M indefinite": (
        lambda: {"M": with_entry(MODEL.M, 4, 4, -1.0)},
        r"M has -1 on its diagonal at dof 4",
    ),
    "a record with NaN": (
        lambda: {"model": replace(MODEL, K=with_entry(MODEL.K, 3, 5, np.nan))},
        r"K\[3, 5\] is nan",
    ),
    "a record unsymmetric": (
        lambda: {"model": replace(MODEL, K=with_entry(MODEL.K, 0, 1, 1e6))},
        r"K is not symmet",
    ),
    "a record with another M": (
        lambda: {"model": replace(MODEL, M=MODEL.M[:-1, :-1])},
        r"M is \(\d+, .*same size",
    ),
    "M and K swapped": (lambda: {"M": MODEL.K, "K": MODEL.M}, r"M and K: .* seem to be swapped"),
    "C drives": (lambda: {"C": -1e-3 * MODEL.K}, r"C feeds energy in"),
    "kn negative": (
        lambda: changed_pair("kn", -1.0),
        r"pair 2: kn = -1, must be finite and between 0",
    ),
    "kt negative": (
        lambda: changed_pair("kt", -2.0),
        r"pair 2: kt = -2, must be finite and between 0",
    ),
    "mu negative": (
        lambda: changed_pair("mu", -0.1),
        r"pair 2: mu = -0\.1, must be finite and between 0",
    ),
    "mu not a number": (lambda: changed_pair("mu", np.nan), r"pair 2: mu = nan"),
    "kn infinite": (
        lambda: changed_pair("kn", np.inf),
        r"contact 1: kn = inf, must be finite and not negative",
    ),
    "preload infinite": (
        lambda: changed_pair("preload", np.inf),
        r"pair 2: preload = inf, must be finite",
    ),
    "weight above 1": (
        lambda: changed_pair("weight", 1.5),
        r"pair 2: weight = 1\.5, .* between 0 and 1",
    ),
    "no pairs": (
        lambda: {"pairs": PAIRS.select(np.zeros(len(PAIRS), bool))},
        r"no (contact )?pair",
    ),
    "no pair carries": (
        lambda: {"weight": 0 * PAIRS.weight},
        r"no pair carries: every weight is 0",
    ),
    "a free body": (
        unheld,
        r"unrestrained even when every contact sticks: body 'damper' (slides|rotates)",
    ),
    "nothing pressed": (
        lambda: {"preload": -PAIRS.preload},
        r"unrestrained at rest, where no contact has stiffness: body"
        r" 'damper' (slides|rotates).*preload",
    ),
    "touching only": (
        {"origin": "unloaded"},
        r"unrestrained at rest, where no contact has stiffness: body 'damper'",
    ),
    "load beside": (
        {"origin": "unloaded", "static": TIP},
        r"unrestrained at rest, where no contact has stiffness",
    ),
    "band empty": (
        {"band": (1300, 1300)},
        r"band = \(1300, 1300\) Hz: both must be positive, and different",
    ),
    "band from zero": ({"band": (0, 100)}, r"band = \(0, 100\) Hz: both must be positive"),
    "band negative": ({"band": (-5, 100)}, r"band = \(-5, 100\) Hz: both must be positive"),
    "band not finite": ({"band": (100, np.inf)}, r"band = \(100, inf\) Hz"),
    "band of three": ({"band": (1, 2, 3)}, r"band = \(1, 2, 3\): must be two frequencies"),
    "forcing of another size": (
        lambda: {"forcing": TIP[:-1]},
        r"forcing of harmonic 1: must be finite with shape",
    ),
    "forcing not a number": (
        lambda: {"forcing": np.nan * TIP},
        r"forcing of harmonic 1: must be finite",
    ),
    "forcing of order 0": (lambda: {"forcing": {0: TIP}}, r"harmonic 0: harmonics count from 1"),
    "no outputs": ({"outputs": {}}, r"outputs: at least one"),
    "output of another size": (
        {"outputs": {"tip": [1.0]}},
        r"output 'tip': must be a finite row of length",
    ),
    "damping negative": ({"damping_ratio": -0.01}, r"damping_ratio = -0\.01: .*0 <= ratio < 1"),
    "damping over-critical": ({"damping_ratio": 1.5}, r"damping_ratio = 1\.5: .*0 <= ratio < 1"),
    "no damping": ({"damping_ratio": None}, r"damping: neither C nor damping_ratio given"),
    "origin misspelt": (
        {"origin": "prelaoded"},
        r"origin = 'prelaoded': must be 'preloaded' or 'unloaded'",
    ),
    "start misspelt": (
        {"start": "zero"},
        r"start = 'zero': must be 'zero_force', 'zero_slider' or",
    ),
    "K complex": (
        lambda: {"K": MODEL.K * (1 + 0.02j)},
        r"K\[0, 0\] is .*j: matrices must be real; .* = eta/2",
    ),
    "M complex": (lambda: {"M": MODEL.M + 0.1j}, r"M\[0, 0\] is .*j: matrices must be real"),
    "C complex": (lambda: {"C": 1e-5j * MODEL.K}, r"C\[0, 0\] is .*j: matrices must be real"),
    "a record complex": (
        lambda: {"model": replace(MODEL, K=MODEL.K * (1 + 0.1j))},
        r"K\[0, 0\] is .*must be real",
    ),
    "K a text": ({"K": "K.mtx"}, r"K = 'K\.mtx': must be a square matrix of numbers"),
    "no law": (
        {"law": None},
        r"law = None: must be a contact law, one of Jenkins1D, DryFriction1T, DryFriction2T",
    ),
    "law a text": ({"law": "DryFriction2T"}, r"law = 'DryFriction2T': must be a contact law"),
    "law of a class of one's own": (
        {"law": CubicSpring},
        r"law = CubicSpring: is the class of a law; make one",
    ),
    "stiffness of a law": (
        {"law": Flat(wrong="stiffness")},
        r"law Flat: stuck_stiffness has the shape \(6,\), must be "
        r"\(P, components\) = \(6, 2\)",
    ),
    "state of a law": (
        {"law": Flat(wrong="state")},
        r"law Flat: initial_state has the shape \(6, 2\), must be",
    ),
    "force of a law": (
        {"law": Flat(wrong="force")},
        r"law Flat: force of step has the shape \(6,\), must be",
    ),
    "no pair table": ({"pairs": None}, r"pairs = None: must be a ContactTable"),
    "no model": ({"model": None}, r"model = None: must be a ReducedModel"),
    "mu a text": (
        lambda: {"mu": ["rough"] * len(PAIRS)},
        r"contact table: mu = .*must hold a number for each pair",
    ),
    "outputs a list": (
        lambda: {"outputs": [TIP]},
        r"outputs = .*: must be a dict \{name: row of length",
    ),
    "outputs a text": ({"outputs": "tip"}, r"outputs = 'tip': must be a dict"),
    "output a text": (
        {"outputs": {"tip": "y"}},
        r"output 'tip' = 'y': must be a row of \d+ real numbers",
    ),
    "output complex": (
        lambda: {"outputs": {"tip": 1j * TIP}},
        r"output 'tip' = .*: must be a row of \d+ real numbers",
    ),
    "damping a text": (
        {"damping_ratio": "2%"},
        r"damping_ratio = '2%': must be a number .*\(2 % is 0\.02\)",
    ),
    "no forcing": ({"forcing": None}, r"no excitation: .* give a forcing"),
    "forcing of harmonic True": (
        lambda: {"forcing": {True: TIP}},
        r"forcing of harmonic True: harmonics count from 1",
    ),
    "static a text": (
        {"static": "gravity", "origin": "unloaded"},
        r"static = 'gravity': must be \d+ real numbers",
    ),
    "start a text list": ({"start": ["a"]}, r"start = \['a'\]: must be 'zero_force'"),
    "samples negative": ({"samples": -8}, r"samples = -8: must be a whole number"),
    "samples too few": ({"samples": 4, "harmonics": 5}, r"samples = 4: .*at least"),
    "at not a number": ({"at": ["x"]}, r"at = "),
    "settings a dict": (
        {"settings": {"max_calls": 500}},
        r"settings = \{'max_calls': 500\}: must be a Settings, "
        r"made by replace\(tipdamp\.hbm\.continuation\.settings\.DEFAULT",
    ),
    "a step of no number": (
        lambda: {"settings": settings(first_step=np.nan)},
        r"settings: first_step = nan: .* above",
    ),
    "a step of text": (
        lambda: {"settings": settings(largest_step="x")},
        r"settings: largest_step = 'x': must be a ",
    ),
    "no aim": (
        lambda: {"settings": settings(aim=0)},
        r"settings: aim = 0: must be a number, above 0",
    ),
    "order 0": (
        lambda: {"settings": settings(highest_order=0)},
        r"settings: highest_order = 0: .*whole number, 1 or",
    ),
    "order 2.5": (
        lambda: {"settings": settings(highest_order=2.5)},
        r"settings: highest_order = 2\.5: .*whole number",
    ),
    "restarts negative": (
        lambda: {"settings": settings(max_restarts=-1)},
        r"settings: max_restarts = -1: .*0 or more",
    ),
    "settings a number": ({"settings": 0}, r"settings = 0: must be a Settings"),
    "progress a number": (
        {"progress": 3},
        r"progress = 3: must be a function \(value, step, calls\)",
    ),
    "progress zero": ({"progress": 0}, r"progress = 0: must be a function"),
}


FOUND_WITH_THE_STUCK_SYSTEM = (
    "a free body",
    "nothing pressed",
    "touching only",
    "load beside",
    "damping negative",
    "damping over-critical",
    "no damping",
    "damping a text",
)


@pytest.mark.parametrize("row", REFUSED)
def test_refused_by_forced_response(row, monkeypatch):
    changes, message = REFUSED[row]

    def heavy(*_, **__):
        raise AssertionError("something heavy has started")

    monkeypatch.setattr(residual.HarmonicBalance, "evaluate", heavy)
    if row not in FOUND_WITH_THE_STUCK_SYSTEM:
        monkeypatch.setattr(problems, "stuck_receptance", heavy)
    else:
        monkeypatch.setattr(linear.la, "eigh", eigh_of_one(linear.la.eigh))
    with warnings.catch_warnings(), pytest.raises(InputError, match=message) as caught:
        warnings.simplefilter("error")
        curve(**(changes() if callable(changes) else changes))
    assert "\n" not in str(caught.value)


def eigh_of_one(eigh):
    """The check for free motions needs one eigenvalue; all of them would be the heavy thing."""

    def only(*a, **k):
        assert "subset_by_index" in k or "subset_by_value" in k, "something heavy has started"
        return eigh(*a, **k)

    return only


def beam_matrices(n):
    """Bernoulli beam of n elements, free at both ends: deflection and rotation of each node."""
    h, K = 1 / n, np.zeros((2 * n + 2,) * 2)
    k = (
        np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, 2 * h * h, -6 * h, 4 * h * h],
            ]
        )
        / h**3
    )
    for i in range(n):
        K[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += k
    return K


@pytest.mark.slow
@pytest.mark.parametrize("elements", [24, 384, 768])
def test_slender_body_clamped_and_free(elements):
    """The softest motion of the clamped beam of 768 elements stores 1.5e-12 of its stiffness,
    rounding 4e-16."""
    K = beam_matrices(elements)
    restraint.check_restrained(K[2:, 2:], None)
    for free in (K, K[1:, 1:], np.delete(np.delete(K, 1, 0), 1, 1)):
        with pytest.raises(
            InputError, match="unrestrained even when every contact sticks: mostly dof"
        ):
            restraint.check_restrained(free, None)


def test_motions_in_words():
    """A turn about the axis with a little noise, a slide, and a motion that deforms; no minus in
    front of a zero."""
    x = MODEL.position[MODEL.body == "damper"]
    axis = np.tile([0, 1, 2], len(x) // 3)
    motion = np.zeros(MODEL.size)
    noise = 1e-3 * np.cross([0, -1.0, -1.0], x - x.mean(axis=0))
    turn = np.cross([1.0, 0, 0], x - x.mean(axis=0)) + noise
    motion[MODEL.body == "damper"] = turn[np.arange(len(x)), axis]
    said = describe_motion(MODEL, motion)
    assert str(said) == "body 'damper' rotates about (1.00, 0.00, 0.00) through (0, 0, 0.000541) m"
    assert said.rigid and said.turns
    motion[MODEL.body == "damper"] = (turn - noise + [0, 0, 0.002])[np.arange(len(x)), axis]
    assert str(describe_motion(MODEL, motion)).endswith("through (0, -0.002, 0.000541) m")
    motion[MODEL.body == "damper"] = np.array([0, 1.0, -1e-4])[axis]
    said = describe_motion(MODEL, motion)
    assert (
        str(said) == "body 'damper' slides along (0.00, 1.00, 0.00)"
        and said.rigid
        and not said.turns
    )
    motion[MODEL.body == "damper"] = (x[:, 0] ** 2)[:] * (axis == 2)
    assert not describe_motion(MODEL, motion).rigid


def test_a_record_whose_mass_is_negative_is_refused():
    """Found with the modes of the stuck system: the one fault that their computation shows
    first."""
    M = MODEL.M.copy()
    M[4, 5] = M[5, 4] = 2 * M[4, 4]
    with pytest.raises(
        InputError, match=r"M is not positive: a motion mostly of dof \d+ has negative mass"
    ):
        curve(model=replace(MODEL, M=M))


@pytest.mark.parametrize(
    "changes, message",
    [
        (
            dict(C=-np.eye(2)),
            r"C feeds energy in: a motion mostly of dof \d has the negative damping -1 N s/m",
        ),
        (dict(C=np.array([[1.0, 2], [2, 1]])), r"C feeds energy in: .* -1 N s/m"),
        (dict(M=np.zeros((2, 2))), r"M is zero: at least one dof must have mass"),
        (
            dict(M=np.diag([1.0, -2])),
            r"M has -2 on its diagonal at dof 1: masses must not be negative",
        ),
        (
            dict(K=np.diag([1.0, -4])),
            r"K is indefinite even when every contact sticks: a motion has a negative stiffness",
        ),
    ],
)
def test_matrices_without_a_bounded_response_are_refused(changes, message):
    """Handed over without a model: two masses, the first under a Jenkins element."""
    given = dict(M=np.eye(2), C=0.1 * np.eye(2), K=np.diag([1.0, 4])) | changes
    with pytest.raises(InputError, match=message):
        problem = ContactProblem(
            **given,
            B=np.array([[1.0, 0]]),
            law=Jenkins1D(),
            contacts=Contacts([0.0], [1.0], [0.5], [1.0]),
        )
        follow_band(problem, [1.0, 0], (0.1, 0.2), outputs={"x": [1.0, 0]})


@pytest.mark.parametrize(
    "changes",
    [
        dict(law=UnilateralSpring()),  # touches from K = 4 N/m
        dict(
            law=UnilateralSpring(),
            K=np.zeros((2, 2)),
            B=np.eye(2),
            preloaded=False,
            static=np.ones(2),
        ),
        dict(law=CubicSpring(1.0), K=np.diag([1e-3, 1e-3])),
    ],
)
def test_supported_or_pressed_bodies_while_open(changes):
    """A mass on its own spring, one that a load presses into contact, and a law that knows no
    opening."""
    given = (
        dict(M=np.eye(2), C=0.1 * np.eye(2), K=np.diag([1.0, 4]), B=np.array([[1.0, 0]])) | changes
    )
    zero, one = np.zeros(len(given["B"])), np.ones(len(given["B"]))
    assert ContactProblem(**given, contacts=Contacts(one, zero, zero, zero)).receptance()


@pytest.mark.parametrize("ratio", [0.01, [0.01, 0.02]], ids=str)
def test_a_damping_matrix_and_ratios_at_once(ratio):
    given = dict(
        M=np.eye(2),
        K=np.eye(2),
        B=np.eye(2),
        law=CubicSpring(1.0),
        contacts=Contacts(*np.zeros((4, 2))),
    )
    with pytest.raises(
        InputError, match="both a damping matrix C and damping_ratio given, exactly one is needed"
    ):
        ContactProblem(**given, C=0.1 * np.eye(2), damping_ratio=ratio)


def test_law_without_stuck_stiffness_restrains_nothing():
    zero, one = np.zeros(2), np.ones(2)
    free = ContactProblem(
        np.eye(2),
        None,
        np.zeros((2, 2)),
        np.eye(2),
        CubicSpring(1.0),
        Contacts(one, zero, zero, zero),
        damping_ratio=0.01,
    )
    with pytest.raises(
        InputError, match="mostly dof .*; law CubicSpring has no stuck stiffness: give it one"
    ):
        free.receptance()


def test_masses_without_any_spring():
    given = dict(
        M=np.eye(2),
        C=None,
        K=np.zeros((2, 2)),
        B=np.eye(2),
        law=UnilateralSpring(),
        damping_ratio=0.01,
    )
    zero, one = np.zeros(2), np.ones(2)
    with (
        warnings.catch_warnings(),
        pytest.raises(InputError, match="at rest, where no contact has stiffness: mostly dof"),
    ):
        warnings.simplefilter("error")
        ContactProblem(**given, contacts=Contacts(one, zero, zero, zero)).receptance()


def test_warning_of_a_buckling_model():
    """Contact may hold what K drives; a dashpot between two dofs leaves their common motion without
    damping."""
    with pytest.warns(
        UserWarning, match=r"K is indefinite: a motion mostly of dof 1 .* stiffness, 1\.0e\+00 of"
    ):
        ReducedModel.from_matrices(np.eye(2), np.diag([1.0, -4]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spring = np.array([[1.0, -1], [-1, 1]])
        ReducedModel.from_matrices(np.eye(2), 1e6 * spring, 3e2 * spring)
        ReducedModel.from_matrices(np.eye(2), np.zeros((2, 2)))


def test_no_warning_of_rounding_in_a_stiffness():
    """Displacements that meet no stiffness, beside one that does: of a damper held at three nodes
    on a line."""
    K = np.array([[-5.3e-23, 2.6e-23, -3.5e-9], [2.6e-23, 0.0, 2.9e-9], [-3.5e-9, 2.9e-9, 2.8e7]])
    K = np.block([[K, np.zeros((3, 1))], [np.zeros((1, 3)), 4.8e14]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ReducedModel.from_matrices(
            np.eye(4), K, node=[1, 1, 1, 0], direction=["x", "y", "z", "mode"]
        )


# ---- input with a known answer -------------------------------------------------------------------


@pytest.mark.slow
def test_no_force_is_the_static_state():
    """Nothing moves from the preloaded state; from the unloaded one, what the load exceeds the
    preload by moves it."""
    found = curve(forcing=0 * TIP)
    assert (
        found.complete and found.ended == "no force: the static state" and len(found.frequency) == 2
    )
    assert np.abs(found.harmonics).max() == 0 and np.abs(found.dissipated).max() == 0
    assert np.isfinite(found.peak("tip")).all()
    gap = -PAIRS.preload / PAIRS.kn  # pressed by as much: closed at q = 0
    B = relative_motion(MODEL, PAIRS).toarray()
    k = np.stack([PAIRS.kt, PAIRS.kt, PAIRS.kn], axis=1).ravel()
    push = B.T @ np.stack([0 * gap, 0 * gap, PAIRS.preload], axis=1).ravel()
    loaded = curve(
        forcing=0 * TIP, origin="unloaded", static=push + 1e-2 * TIP, gap=gap, start="zero_slider"
    )
    expected = TIP @ np.linalg.solve(MODEL.K + (B.T * k) @ B, 1e-2 * TIP)
    assert loaded.complete and loaded.harmonics[0, 0, 0].real == pytest.approx(expected, rel=1e-9)
    assert np.abs(loaded.harmonics[..., 1:]).max() == 0


def test_no_friction_is_the_linear_system():
    """mu = 0 while every pair stays closed: normal springs alone, to 1e-10; modes of damping as in
    the stuck system."""
    found = curve(mu=0 * PAIRS.mu, forcing=1e-3 * TIP, harmonics=3)
    assert found.complete and np.nanmax(found.share_open) == 0
    B = relative_motion(MODEL, PAIRS).toarray()
    tangent = np.kron(np.diag(PAIRS.kt), np.diag([1.0, 1, 0])) + np.kron(
        np.diag(PAIRS.kn), np.diag([0, 0, 1.0])
    )
    stuck = MODEL.K + B.T @ tangent @ B
    normal = MODEL.K + (B.T * np.kron(PAIRS.kn, [0, 0, 1.0])) @ B
    receptance = free_receptance(MODEL.M, stuck, 0.02)  # its modes carry the damping
    C = (
        np.linalg.inv(receptance.shapes).T
        @ np.diag(0.04 * np.sqrt(receptance.stiffness))
        @ np.linalg.inv(receptance.shapes)
    )
    for f, X in zip(found.frequency[::7], found.harmonics[::7, 0, 1], strict=True):
        w = 2 * np.pi * f
        expected = TIP @ np.linalg.solve(normal - w**2 * MODEL.M + 1j * w * C, 1e-3 * TIP)
        assert abs(X - expected) < 1e-10 * np.abs(found.harmonics[:, 0, 1]).max()


def test_band_from_high_to_low():
    up, down = curve(), curve(band=(1500, 1100))
    assert (
        down.complete
        and down.frequency[0] == pytest.approx(1500)
        and down.frequency[-1] == pytest.approx(1100)
    )
    assert down.peak("tip")[1] == pytest.approx(up.peak("tip")[1], rel=1e-8)
