"""Every output of tests/reference/stiffness/cases.json (origin in its README) within the tolerance
stated there."""

import json
from pathlib import Path

import numpy as np
import pytest

from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair
from tipdamp.static_contact.stiffness.flat_punch import (
    ellipse_integrals,
    ellipse_stiffness,
    rectangle_stiffness,
    slender_strip_stiffness,
    uniform_line_stiffness,
)
from tipdamp.static_contact.stiffness.load_displacement import approach, secant_stiffness
from tipdamp.static_contact.stiffness.nodal_stiffness import StiffnessModel, nodal_stiffness
from tipdamp.static_contact.stiffness.partial_slip import slip_displacement, stick_load
from tipdamp.static_contact.stiffness.plane_strain import plane_stiffness
from tipdamp.static_contact.stiffness.rounded_punch import (
    hertz_half_width,
    hertz_peak_pressure,
    punch_half_width,
    punch_peak,
    punch_pressure,
)
from tipdamp.static_contact.stiffness.side_stiffness import ContactSide, half_width

CASES = {
    case["id"]: case
    for case in json.loads(
        (Path(__file__).parents[2] / "reference" / "stiffness" / "cases.json").read_text()
    )["cases"]
}


def moduli(pair, i):
    return {
        "E_star_Pa": pair.E_star,
        "G1_Pa": pair.G1,
        "G2_Pa": pair.G2,
        "dundurs_alpha": pair.dundurs_alpha,
        "dundurs_beta": pair.dundurs_beta,
    }


def line_compliance(pair, i, component):
    def compliance(load):
        a = hertz_half_width(load, i["R_m"], pair.E_star)
        return 1 / getattr(plane_stiffness(pair, a, i["d1_m"], i["d2_m"]), component)

    return compliance


def line2d(pair, i):
    load = i["N_N"] / i["L_m"]
    a = hertz_half_width(load, i["R_m"], pair.E_star)
    k = plane_stiffness(pair, a, i["d1_m"], i["d2_m"])
    normal = line_compliance(pair, i, "normal")
    return {
        "P_line_N_per_m": load,
        "a_m": a,
        "p0_Pa": hertz_peak_pressure(load, a),
        "p_mean_Pa": load / (2 * a),
        "Kn_line_tangent_N_per_m2": k.normal,
        "Kt_across_line_tangent_N_per_m2": k.across,
        "Kt_along_line_tangent_N_per_m2": k.along,
        "delta_n_m": approach(normal, load),
        "Kn_line_secant_N_per_m2": secant_stiffness(normal, load),
        "Kn_total_tangent_N_per_m": k.normal * i["L_m"],
    }


def rounded_punch(pair, i):
    b, radius, load = i["b_flat_half_width_m"], i["R_edge_m"], i["P_line_N_per_m"]
    punch = (b, radius, pair.E_star)
    a = punch_half_width(load, *punch)
    x_peak, p_peak = punch_peak(load, *punch)
    k = plane_stiffness(pair, a, i["d1_m"], i["d2_m"])
    hertz = hertz_half_width(load, radius, pair.E_star)
    values = {
        "a_m": a,
        "b_over_a": b / a,
        "p_centre_Pa": punch_pressure(0.0, load, *punch),
        "p_peak_Pa": p_peak,
        "x_peak_m": x_peak,
        "hertz_a_m": hertz,
        "hertz_p0_Pa": hertz_peak_pressure(load, hertz),
        "Kn_line_tangent_N_per_m2": k.normal,
        "Kt_across_line_tangent_N_per_m2": k.across,
        "p_at_0.5_a_Pa": punch_pressure(0.5 * a, load, *punch),
    }
    if "mu" in i:
        c = punch_half_width(stick_load(load, i["mu"], i["Q_over_muP"] * i["mu"] * load), *punch)
        values |= {
            "p_at_0.95_a_Pa": punch_pressure(0.95 * a, load, *punch),
            "stick_half_width_c_m": c,
            "c_over_a": c / a,
        }
    return values


def flat2d(pair, i):
    k = plane_stiffness(pair, i["width_m"] / 2, i["d1_m"], i["d2_m"]).scaled(i["L_m"])
    return {
        "Kn_total_N_per_m": k.normal,
        "Kt_across_total_N_per_m": k.across,
        "Kt_along_total_N_per_m": k.along,
        "ratio_across": k.across / k.normal,
        "ratio_along": k.along / k.normal,
    }


def circle(pair, i):
    k = ellipse_stiffness(pair, i["a_m"], i["a_m"])
    return {"Kn_N_per_m": k.normal, "Kt_N_per_m": k.along, "ratio": k.across / k.normal}


def ellipse(pair, i):
    k = ellipse_stiffness(pair, i["a_m"], i["b_m"])
    s = ellipse_integrals(i["a_m"], i["b_m"])
    return {
        "S0_per_m": s[0],
        "S_long_per_m": s[1],
        "S_short_per_m": s[2],
        "Kn_N_per_m": k.normal,
        "Kt_along_long_N_per_m": k.along,
        "Kt_across_short_N_per_m": k.across,
        "ratio_long": k.along / k.normal,
        "ratio_short": k.across / k.normal,
    }


def partial_slip_line(pair, i):
    load = i["N_N"] / i["L_m"]
    across, mu = line_compliance(pair, i, "across"), i["mu"]
    q = i["Q_over_muN"] * mu * load
    delta, gross = (slip_displacement(across, load, mu, value) for value in (q, mu * load))
    a, c = (hertz_half_width(p, i["R_m"], pair.E_star) for p in (load, stick_load(load, mu, q)))
    return {
        "a_m": a,
        "c_over_a": c / a,
        "Q_line_N_per_m": q,
        "delta_t_m": delta,
        "delta_t_gross_slip_m": gross,
        "Kt_line_initial_N_per_m2": 1 / across(load),
        "Kt_line_secant_N_per_m2": q / delta,
        "Kt_line_secant_gross_N_per_m2": mu * load / gross,
    }


def rect3d(pair, i):
    k, area = rectangle_stiffness(pair, i["L_m"], i["width_m"]), i["L_m"] * i["width_m"]
    return {
        "Kn_over_Estar_m": k.normal / pair.E_star,
        "Kn_N_per_m": k.normal,
        "Kt_across_width_N_per_m": k.across,
        "Kt_along_length_N_per_m": k.along,
        "ratio_across": k.across / k.normal,
        "ratio_along": k.along / k.normal,
        "shape_factor_Kn_over_2Estar_sqrtA_pi": k.normal
        / (2 * pair.E_star * np.sqrt(area / np.pi)),
    }


def line3d_finite(pair, i):
    side = ContactSide("cylinder", i["L_m"], pair, radius=i["R_m"])
    a = half_width(side, i["N_N"])
    tangent, chord = (
        nodal_stiffness(side, i["N_N"], 31, StiffnessModel(kind=kind)).total.normal
        for kind in ("tangent", "secant")
    )
    return {
        "a_hertz_m": a,
        "Kn_secant_N_per_m": chord,
        "Kn_tangent_N_per_m": tangent,
        "delta_n_m": i["N_N"] / chord,
        "slender_rect_Kn_tangent_N_per_m": slender_strip_stiffness(pair, i["L_m"], a),
        "uniform_load_centre_Kn_tangent_N_per_m": uniform_line_stiffness(pair, i["L_m"], a),
    }


ROUTES = {
    f.__name__: f
    for f in (
        moduli,
        line2d,
        rounded_punch,
        flat2d,
        circle,
        ellipse,
        partial_slip_line,
        rect3d,
        line3d_finite,
    )
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_reference_case(case):
    i = case["inputs"]
    pair = MaterialPair(i["E1_Pa"], i["nu1"], i["E2_Pa"], i["nu2"])
    found = ROUTES[case["kind"]](pair, i)
    assert found.keys() == case["outputs"].keys()
    for name, expected in case["outputs"].items():
        assert found[name] == pytest.approx(expected, rel=case["rel_tol"]), name
