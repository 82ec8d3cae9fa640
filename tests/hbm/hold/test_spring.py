"""Rigid motions that a soft spring, or a constraint of their mean, holds; and structures that float
as a whole."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from tests.contact_tables import contact_table
from tests.hbm.small_rig import small_rig
from tipdamp import (
    ContactProblem,
    Contacts,
    ContactTable,
    DryFriction2T,
    HeldMotion,
    Hold,
    InputError,
    Jenkins1D,
    ReducedModel,
    compare,
    contact_problem,
    follow_band,
    follow_parameter,
    forced_response,
    linear_response,
    solve_at,
)
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.hold.rigid_motion import body_motions, parse_motion, rigid_coordinate
from tipdamp.hbm.hold.spring import held_motions

MODEL, PAIRS, TIP = small_rig()
MU, KN, N0 = 0.3, 1e6, 50.0


def block(mass=2.0, stiffness=1e5):
    """(model, pairs): a block that slides along x on the ground, on a spring along z, none along
    x."""
    K = np.diag([0.0, stiffness, stiffness])
    model = ReducedModel.from_matrices(
        np.eye(3) * mass,
        K,
        1e-4 * K,
        body="damper",
        node=[1, 1, 1],
        direction=["x", "y", "z"],
        position=np.zeros((3, 3)),
    )
    return model, contact_table(np.eye(3)[None], kn=KN, kt=1e7, mu=MU, preload=N0)


def shaken(size, w, amount):
    """Force along x far above friction, and along z so that N = N0 + amount cos(w t) where the
    block moves as sin."""
    model, _ = block()
    force = np.zeros(3, dtype=complex)
    force[0] = size * 1j  # -m w^2 x = F: x' = F/(m w) cos
    force[2] = amount / KN * (model.K[2, 2] + KN - model.M[2, 2] * w**2 + 1j * w * model.C[2, 2])
    return force


@pytest.mark.parametrize(
    "hold", [Hold("x"), Hold("slide along x", 50.0), Hold([2, 0, 0], mean=True)], ids=str
)
def test_reaction_is_the_mean_friction_force(hold):
    """N0 + a cos over a full slip with v ~ cos: the mean of mu N sign(v) is 2/pi mu a, as the
    friction force acts."""
    w, amount = 2 * np.pi * 40, 20.0
    model, pairs = block()
    problem, _ = contact_problem(model, pairs, DryFriction2T(), hold=hold)
    found = solve_at(problem, shaken(2e3, w, amount), 40.0, harmonics=9, outputs={"x": [1.0, 0, 0]})
    assert found.converged and found.held == ("damper: slide along x",)
    assert found.reaction[0, 0].real == pytest.approx(-2 / np.pi * MU * amount, rel=2e-3)
    if hold.mean:
        assert np.abs(found.reaction[0, 1:]).max() == 0 and abs(found.harmonics[0, 0]) < 1e-12
    else:
        assert found.reaction[0] == pytest.approx(
            problem.held[0].stiffness * found.harmonics[0], rel=1e-9
        )


def test_nothing_holds_the_block():
    """Without a hold the same force has no periodic state, and the message names what would
    help."""
    model, pairs = block()
    curve = forced_response(
        model,
        pairs,
        DryFriction2T(),
        shaken(2e3, 2 * np.pi * 40, 20.0),
        (40, 60),
        harmonics=3,
        outputs={"x": [1.0, 0, 0]},
    )
    assert not curve.complete
    free = replace(model, K=np.diag([0.0, 1e5, 0.0]))
    with pytest.raises(InputError, match=r"slides along \(1.00, 0.00, 0.00\)|mostly dof 0"):
        forced_response(
            free,
            pairs.replace(kt=[0.0]),
            DryFriction2T(),
            [1.0, 0, 0],
            (40, 60),
            outputs={"x": [1, 0, 0]},
        )


@pytest.mark.parametrize("mean", [False, True])
def test_time_integration_of_a_held_block(mean):
    """Another route to the same motion; where only the mean is held it stands on the spring."""
    model, pairs = block()
    w = 2 * np.pi * 40
    problem, _ = contact_problem(
        model, pairs.replace(kt=[1e7]), DryFriction2T(), hold=Hold("x", 5e3, mean)
    )
    curve = follow_band(
        problem, shaken(2e2, w, 20.0), (40, 44), harmonics=25, outputs={"z": [0, 0, 1.0]}, at=[42]
    )
    assert curve.complete
    found = compare(curve, problem, 42.0)
    assert found.difference < 1e-3


def test_spring_of_a_hold_is_that_spring():
    """The same as a stiffness k row row' that someone adds to K."""
    hold = Hold("x", 2e4)
    problem, _ = contact_problem(MODEL, PAIRS, DryFriction2T(), damping_ratio=0.01, hold=hold)
    one = problem.held[0]
    given = dict(harmonics=3, outputs={"tip": TIP})
    stiff = replace(MODEL, K=MODEL.K + 2e4 * np.outer(one.row, one.row))
    plain, _ = contact_problem(stiff, PAIRS, DryFriction2T(), damping_ratio=0.01)
    for level in (1.0, 30.0):
        a, b = (solve_at(p, level * TIP, 950.0, **given) for p in (problem, plain))
        assert a.converged and a.harmonics == pytest.approx(b.harmonics, rel=1e-9)
    assert one.unit == "N" and one.name == "damper: slide along x"


def test_coordinate_of_a_rigid_motion():
    """It measures its own motion and no other, nothing elastic, and is a pure force or couple."""
    model = small_rig(roll=0.0)[0]
    R, mine = body_motions(model, "damper"), model.body == "damper"
    values, shapes = scipy.linalg.eigh(*(A[np.ix_(mine, mine)] for A in (model.K, model.M)))
    elastic = np.zeros((model.size, mine.sum()))
    elastic[mine] = shapes
    for k, word in enumerate(("x", "y", "z", "about x", "about y", "about z")):
        row, motion = rigid_coordinate(model, "damper", parse_motion(word)[2])
        assert row @ motion == pytest.approx(1)
        assert np.abs(row @ elastic[:, values > 1e-6 * values[-1]]).max() < 1e-9 * np.linalg.norm(
            row
        )
        if k >= 3:
            assert row @ R == pytest.approx(np.eye(6)[k], abs=1e-9)
        else:
            assert row @ R[:, :3] == pytest.approx(np.eye(3)[k], abs=1e-12)


def test_a_soft_hold_changes_nothing():
    """On a motion that the contacts hold the default spring stays below a millionth; a hard one is
    warned of."""
    given = dict(damping_ratio=0.01, outputs={"tip": TIP}, harmonics=3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        soft = forced_response(
            MODEL, PAIRS, DryFriction2T(), TIP, (1000, 1400), hold=Hold("x"), **given
        )
    none = forced_response(MODEL, PAIRS, DryFriction2T(), TIP, (1000, 1400), **given)
    assert soft.peak("tip") == pytest.approx(none.peak("tip"), rel=2e-5) and soft.held_change < 1e-4
    assert (
        none.held.size == 0
        and none.reaction.shape == (len(none.frequency), 0, 4)
        and none.held_change == 0
    )
    with pytest.warns(
        UserWarning, match="ten times the stiffness of what holds damper: roll about x, the peak or"
    ):
        hard = forced_response(
            MODEL, PAIRS, DryFriction2T(), TIP, (1000, 1400), hold=Hold("about x", 3e2), **given
        )
    assert hard.held_change > 1e-4 and abs(none.peak("tip")[0] - 1200) < 190


def test_sticking_contacts_carry_the_mean_force():
    """A slider that starts stretched: the spring takes a share by its stiffness, a stop the whole
    kt w."""
    model, pairs = block()
    given = dict(harmonics=3, outputs={"x": [1.0, 0, 0]}, start=[[1e-6, 0.0]])
    with pytest.warns(
        UserWarning, match="changes by 90 % of itself: sticking contacts carry the mean force"
    ):
        soft = forced_response(
            model, pairs, DryFriction2T(), [1.0, 0, 0.5], (30, 60), hold=Hold("x"), **given
        )
    assert soft.held_reaction_change == pytest.approx(0.9, rel=1e-3) and soft.held_change < 1e-4
    stop = forced_response(
        model, pairs, DryFriction2T(), [1.0, 0, 0.5], (30, 60), hold=Hold("x", mean=True), **given
    )
    assert stop.reaction[0, 0, 0].real == pytest.approx(10.0) and stop.held_reaction_change == 0


def test_ten_times_the_stiffness_in_steps():
    """From the soft spring Newton's method does not come to the stiffer one at once; in steps it
    does."""
    model, pairs, tip = small_rig(stations=5, roll=0.0)
    with pytest.warns(
        UserWarning,
        match="damper: roll about x: moves by up to .* rad, of which the mean is .*about "
        "0.01 rad: give a larger stiffness, or mean = true",
    ) as said:
        curve = forced_response(
            model,
            pairs,
            DryFriction2T(),
            40 * tip,
            (1050, 1300),
            hold=Hold("about x", 1e-2),
            damping_ratio=0.01,
            outputs={"tip": tip},
            harmonics=1,
        )
    assert curve.held_change < 1e-4 and not [
        one for one in said if "no solution" in str(one.message)
    ]


def test_saved_with_its_reaction(tmp_path):
    curve = forced_response(
        MODEL,
        PAIRS,
        DryFriction2T(),
        TIP,
        (930, 940),
        hold=Hold("x", mean=True),
        harmonics=1,
        damping_ratio=0.01,
        outputs={"tip": TIP},
    )
    assert curve.load(curve.save(tmp_path / "curve.npz")) == curve
    assert curve.reaction.shape == (len(curve.frequency), 1, 2)


REFUSED = {
    "unknown motion": (
        Hold("axially"),
        r"hold = 'axially': must be a direction \[x, y, z\], 'x', 'y' or 'z'",
    ),
    "no motion": (Hold([0, 0, 0]), r"hold = .*must be a direction"),
    "two numbers": (Hold([0, 1]), r"hold = .*must be a direction"),
    "negative": (
        Hold("x", -1.0),
        r"hold = 'x': stiffness = -1\.0: must be one positive number in N/m",
    ),
    "a text": (
        Hold("about x", "soft"),
        r"stiffness = 'soft': must be one positive number in N m/rad",
    ),
    "no body": (Hold("x", body="dampr"), r"the model has no body 'dampr'; did you mean 'damper'"),
    "no hold but a text": ("x", r"hold = 'x': must be a Hold, made by Hold\('y'\)"),
    "nothing": (None, r"hold = None: must be a Hold, made by Hold\('y'\)"),
    "a clamped body": (
        Hold("y", body="blade1"),
        r"the blade1 is supported: its own stiffness resists this motion",
    ),
    "mean a text": (Hold("x", mean="yes"), r"mean = 'yes': must be True or False"),
    "twice": ([Hold("x"), Hold([1, 0, 0], 5.0)], r"a motion is held twice; leave one of them out"),
}


@pytest.mark.parametrize("row", REFUSED)
def test_refused(row):
    hold, message = REFUSED[row]
    with pytest.raises(InputError, match=message):
        contact_problem(MODEL, PAIRS, DryFriction2T(), damping_ratio=0.01, hold=hold)


@pytest.mark.parametrize("size", [1e-200, 1e300])
def test_direction_of_any_length(size):
    name, _, coefficients = parse_motion([3 * size, 4 * size, 0])
    assert name == "slide along (0.6, 0.8, 0)" and coefficients == pytest.approx(
        [0.6, 0.8, 0, 0, 0, 0]
    )


def test_bodies_that_cannot_move_so():
    model, pairs = block()
    with pytest.raises(
        InputError, match=r"hold = 'about y': the damper has no such motion in the model"
    ):
        contact_problem(model, pairs, DryFriction2T(), hold=Hold("about y"))
    with pytest.raises(InputError, match="no pair resists this motion even where it sticks"):
        contact_problem(model, pairs.replace(kt=[0.0]), DryFriction2T(), hold=Hold("x"))


def test_normals_that_hold_already():
    """Said where they are called, by either function."""
    with pytest.warns(
        UserWarning,
        match="hold = 'z': contact normals face the slide along z of the damper by 0.57",
    ) as one:
        contact_problem(MODEL, PAIRS, DryFriction2T(), damping_ratio=0.01, hold=Hold("z"))
    assert "for curves that end without it as the damper rolls or slides" in str(one[0].message)
    with pytest.warns(UserWarning, match="hold = 'z': contact normals face") as other:
        forced_response(
            MODEL,
            PAIRS,
            DryFriction2T(),
            TIP,
            (930, 932),
            damping_ratio=0.01,
            hold=Hold("z"),
            harmonics=1,
            outputs={"tip": TIP},
        )
    assert {said.filename for said in (*one, *other)} == {__file__}


def test_normals_that_a_combined_motion_passes():
    """One contact at the end of a bar faces the roll about its middle, but not the roll with a
    slide along z."""
    position = np.repeat([[-1.0, 0, 0], [1.0, 0, 0]], 3, axis=0)
    bar = ReducedModel.from_matrices(
        np.eye(6),
        np.zeros((6, 6)),
        body="damper",
        node=[1, 1, 1, 2, 2, 2],
        direction=["x", "y", "z"] * 2,
        position=position,
    )
    one = contact_table(np.eye(3)[None], kn=KN, kt=1e7, mu=MU, preload=N0)
    both = contact_table(
        np.eye(3)[None].repeat(2, axis=0), damper_node=[1, 2], kn=KN, kt=1e7, mu=MU, preload=N0
    )
    assert held_motions(bar, one, Hold("about y", 1.0))[0].doubt == ""
    assert (
        "whatever other rigid motions go with it"
        in held_motions(bar, both, Hold("about y", 1.0))[0].doubt
    )


# ---- structures that float as a whole ------------------------------------------------------------

M1, M2, STIFF = 2.0, 3.0, 4e4
REDUCED = M1 * M2 / (M1 + M2)


def two_masses(**changes):
    """Two masses, a spring and a Jenkins element between them, nothing to the ground."""
    link = np.array([[1.0, -1], [-1, 1]])
    given = dict(
        M=np.diag([M1, M2]),
        C=8.0 * link,
        K=STIFF * link,
        B=np.array([[1.0, -1]]),
        law=Jenkins1D(),
        contacts=Contacts([0.0], [6e4], [1.0], [10.0]),
    )
    return ContactProblem(**given | changes)


def relative(**changes):
    """Their relative motion: one mass, the reduced one, on the same spring to the ground."""
    given = dict(
        M=[[REDUCED]],
        C=[[8.0]],
        K=[[STIFF]],
        B=[[1.0]],
        law=Jenkins1D(),
        contacts=Contacts([0.0], [6e4], [1.0], [10.0]),
    )
    return ContactProblem(**given | changes)


@pytest.mark.parametrize("damping", [{}, {"C": None, "damping_ratio": 0.02}], ids=["C", "ratio"])
def test_two_free_masses_are_one_reduced_mass(damping):
    """The relative motion is that of the reduced mass under F m_r/m_1; the centre of mass moves as
    F/(M w^2)."""
    F, centre = np.array([12.0, 0]), np.array([M1, M2]) / (M1 + M2)
    outputs = {"between": [1.0, -1], "centre": centre}
    free = follow_band(two_masses(**damping), F, (20, 60), harmonics=5, outputs=outputs, at=[33])
    fixed = follow_band(
        relative(**damping),
        [12.0 * REDUCED / M1],
        (20, 60),
        harmonics=5,
        outputs={"x": [1.0]},
        at=[33],
    )
    assert free.complete and free.share_slip.max() > 0.1
    assert free.peak("between") == pytest.approx(fixed.peak("x"), rel=1e-8)
    i, j = (int(np.flatnonzero(c.frequency == 33)[0]) for c in (free, fixed))
    assert free.harmonics[i, 0] == pytest.approx(fixed.harmonics[j, 0], rel=1e-8, abs=1e-14)
    assert free.harmonics[i, 1, 1] == pytest.approx(
        -12.0 / ((M1 + M2) * (2 * np.pi * 33) ** 2), rel=1e-9
    )
    problem = two_masses(**damping)
    assert problem.receptance().frequencies[0] == 0
    assert compare(free, problem, 33.0).difference < 1e-3


LINK, MASS = np.array([[1.0, -1], [-1, 1]]), np.diag([M1, M2])
DRAG = {
    "by mass": 4.0 * MASS,
    "by mass and stiffness": 4.0 * MASS + 1e-4 * STIFF * LINK,
    "dashpots to the ground": 8.0 * np.eye(2),
    "one dashpot": np.diag([8.0, 0.0]),
}


@pytest.mark.parametrize("C", DRAG.values(), ids=DRAG)
def test_damping_of_a_free_structure_to_the_ground(C):
    """The contact sticks: the motion is that of the matrices; it slips: as on a spring to the
    ground too soft to tell; and in time."""
    F, rows = np.array([60.0, 15.0j]), {"1": [1.0, 0], "2": [0, 1.0]}
    stuck = follow_band(
        two_masses(C=C, contacts=Contacts([0.0], [6e4], [1.0], [1e5])),
        F,
        (0.5, 60),
        harmonics=1,
        outputs=rows,
    )
    assert stuck.complete and stuck.share_stick.min() == 1
    for hz, X in zip(stuck.frequency, stuck.harmonics[:, :, 1], strict=True):
        w = 2 * np.pi * hz
        Z = (STIFF + 6e4) * LINK + 1j * w * C - w**2 * MASS
        assert X == pytest.approx(np.linalg.solve(Z, F), rel=1e-8)
    free, soft = two_masses(C=C), two_masses(C=C, K=STIFF * LINK + 1e-4 * np.eye(2))
    one, other = (solve_at(problem, F, 33.0, harmonics=5, outputs=rows) for problem in (free, soft))
    assert one.converged and one.share_slip.max() > 0.1
    assert one.harmonics[:, 1:] == pytest.approx(other.harmonics[:, 1:], rel=1e-6, abs=1e-12)
    curve = follow_band(free, F, (30, 36), harmonics=5, outputs=rows)
    assert compare(curve, free, 33.0).difference < 1e-3 and np.nanmax(curve.energy_error) < 1e-8
    more = follow_parameter(free, F, 33.0, "damping", (1.0, 2.0), harmonics=5, outputs=rows)
    twice = solve_at(two_masses(C=2 * C), F, 33.0, harmonics=5, outputs=rows)
    assert more.complete and more.harmonics[-1] == pytest.approx(
        twice.harmonics, rel=1e-7, abs=1e-12
    )


def test_linear_response_of_a_free_model_with_its_own_damping():
    model = ReducedModel.from_matrices(MASS, STIFF * LINK, 4.0 * MASS)
    found = linear_response(
        model, None, [12.0, 0], [5.0, 40.0], None, {"1": [1.0, 0], "2": [0, 1.0]}
    )
    for hz, X in zip([5.0, 40.0], found, strict=True):
        Z = STIFF * LINK + 8j * np.pi * hz * MASS - (2 * np.pi * hz) ** 2 * MASS
        assert X == pytest.approx(np.linalg.solve(Z, [12.0, 0]), rel=1e-9)
    with pytest.raises(
        InputError, match="0 Hz: a constant force acts along a motion that nothing restrains"
    ):
        linear_response(model, None, [12.0, 0], [0.0, 40.0], None, {"1": [1.0, 0]})


def test_free_structure_with_modes_enough_for_a_series():
    """A free chain of many masses, where the modes far above enter the receptance by a series."""
    n = 80
    K = 1e7 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0] = K[-1, -1] = 1e7
    row = np.zeros(n)
    row[[10, 70]] = 1.0, -1.0
    given = dict(
        C=None, damping_ratio=0.01, law=Jenkins1D(), contacts=Contacts([0.0], [1e5], [1.0], [2.0])
    )
    force = np.eye(n)[0] * 5
    chain = ContactProblem(np.eye(n), K=K, B=row[None], **given)
    found = solve_at(chain, force, 19.0, harmonics=5, outputs={"x": np.eye(n)[5]})
    soft = 1e-4 * np.ones((n, n)) / n  # 1e-4 N/m against the motion as a whole
    held = solve_at(
        replace(chain, K=K + soft), force, 19.0, harmonics=5, outputs={"x": np.eye(n)[5]}
    )
    assert found.converged and found.share_slip.max() > 0.05
    assert found.harmonics[0, 1:] == pytest.approx(held.harmonics[0, 1:], rel=1e-6, abs=1e-12)


def test_free_structures_that_are_refused():
    """A constant force along the motion, however it is damped, and a body that its contacts leave a
    mechanism."""
    given = dict(harmonics=1, outputs={"x": [1.0, 0]})
    with pytest.raises(
        InputError, match="a constant force acts along a motion that nothing restrains: mostly dof"
    ):
        follow_band(two_masses(static=[1.0, 0]), [1.0, 0], (20, 60), **given)
    with pytest.raises(
        InputError, match="a constant force acts along a motion that nothing restrains: mostly dof"
    ):
        follow_band(two_masses(static=[1.0, 0], C=8.0 * np.eye(2)), [1.0, 0], (20, 60), **given)
    assert follow_band(two_masses(static=[1.0, -1.0]), [1.0, 0], (20, 60), **given).complete
    lever = dict(
        M=np.eye(3), C=None, K=np.diag([4e4, 0, 0]), B=np.array([[1.0, -1, 0]]), damping_ratio=0.01
    )
    with pytest.raises(
        InputError, match="a motion is unrestrained even when every contact sticks: mostly dof 2"
    ):
        follow_band(
            two_masses(**lever), np.ones(3), (20, 60), harmonics=1, outputs={"x": [1.0, 0, 0]}
        )


def test_held_mean_that_nothing_else_resists():
    model, pairs = block()
    with pytest.raises(
        InputError, match=r"slides along \(1.00, 0.00, 0.00\); .*; mean = true holds no vibration"
    ):
        contact_problem(
            model, pairs.replace(kt=[0.0]), DryFriction2T(), hold=Hold("x", 5.0, mean=True)
        )[0].receptance()
    problem = two_masses(
        held=(HeldMotion("all", "N", np.array([0.4, 0.6]), np.ones(2), 1.0, mean=True),)
    )
    with pytest.raises(
        InputError, match="no contact resists the motion even where it sticks; hold it by a spring"
    ):
        problem.receptance()


def test_linear_response_of_a_free_model_stays_as_it_was():
    model, _ = block()
    found = linear_response(model, None, [1.0, 0, 0], [40.0], 0.01, {"x": [1.0, 0, 0]})
    assert found[0, 0] == pytest.approx(-1 / (2.0 * (2 * np.pi * 40) ** 2))
    assert isinstance(block()[1], ContactTable)


# ---- where nothing is held -----------------------------------------------------------------------

ADVICE = (
    r"hold its mean position, .* hold = \{ motion = 'x', mean = true \}.* start it further "
    r"from the resonance"
)


def test_a_block_that_slides_away_is_named_before_the_general_advice():
    """No first point: it drifts with its mean friction force. With the hold that is advised there
    is one."""
    w = 2 * np.pi * 40
    model, pairs = block()
    given = dict(
        law=DryFriction2T(),
        forcing=shaken(2e3, w, 20.0),
        band=(38, 42),
        harmonics=3,
        outputs={"x": [1.0, 0, 0]},
        settings=Settings(max_first_calls=300),
    )
    lost = forced_response(model, pairs, **given)
    assert not lost.converged.any()
    assert re.match(
        r"nothing but friction restrains a motion \(body 'damper' slides along \(1.00, 0.00, "
        r"0.00\)\): .*" + ADVICE,
        lost.ended,
    )
    assert forced_response(model, pairs, hold=Hold("x", mean=True), **given).complete
    problem, _ = contact_problem(model, pairs, DryFriction2T())
    with pytest.warns(UserWarning, match="at 40 Hz; nothing but friction restrains a motion .body"):
        options = {key: given[key] for key in ("harmonics", "outputs", "settings")}
        assert not solve_at(problem, given["forcing"], 40.0, **options).converged


def test_motions_that_friction_alone_restrains():
    """A block on a plane slides along both tangents; a hold, or a spring, takes one of them
    away."""
    model, pairs = block()
    both = replace(model, K=np.diag([0.0, 0.0, 1e5]))
    count = [
        contact_problem(one, pairs, DryFriction2T(), damping_ratio=0.01, hold=hold)[0]
        .held_by_friction()
        .shape[1]
        for one, hold in ((both, ()), (both, Hold("x", mean=True)), (model, ()), (model, Hold("x")))
    ]
    assert count == [2, 1, 1, 0]
    motions = contact_problem(both, pairs, DryFriction2T(), damping_ratio=0.01)[
        0
    ].held_by_friction()
    assert np.abs(motions / np.abs(motions).max(axis=0)) == pytest.approx(
        np.eye(3)[:, :2], abs=1e-9
    )
