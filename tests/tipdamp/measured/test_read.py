"""The same measured curve from files of every kind, and what is wrong with others."""

import numpy as np
import pytest

from tests.tipdamp.measured.oscillator import grid, receptance
from tipdamp.hbm.errors import InputError
from tipdamp.measured.read import read_measured
from tipdamp.measured.universal import FrfAt, from_universal, write_universal
from tipdamp.study.schema import Measured

HZ = grid(step=10.0)
X = receptance(HZ)
POLAR = ("frequency_hz", "amplitude", "phase_deg")


def settings(**values):
    """Keys that are None are left out."""
    given = {"files": "x", "quantity": "receptance", "unit": "um/N", "level": 2.0, **values}
    return Measured.model_validate(
        {key: value for key, value in given.items() if value is not None}
    )


def rows(*columns, part=",", head="f,amplitude,phase\n", end="\n"):
    return (
        head
        + end.join(part.join(f"{v:.15g}" for v in row) for row in zip(*columns, strict=True))
        + end
    )


def text_file(folder, text, name="run.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def read_one(path, **values):
    (frf,), said = read_measured([path], settings(**values))
    return frf, said


@pytest.mark.parametrize(
    ("part", "end", "head", "encoding"),
    [
        (",", "\n", "f,amplitude,phase\n", "utf-8"),
        (";", "\r\n", "# run of Monday\r\nf;a;p\r\n", "utf-8-sig"),
        ("\t", "\n", "", "utf-8"),
        (" ", "\n", "% shaker at the root, 20 \N{DEGREE SIGN}C\n", "latin-1"),
    ],
)
def test_text_files(tmp_path, part, end, head, encoding):
    text = rows(HZ, 1e6 * np.abs(X), np.degrees(np.angle(X)), part=part, head=head, end=end)
    frf, said = read_one(text_file(tmp_path, text, encoding=encoding), columns=list(POLAR))
    np.testing.assert_allclose(frf.response, X, rtol=1e-12)
    assert (frf.force_N, said) == (2.0, [])


def test_columns_by_name_and_per_measured_force(tmp_path):
    force = np.linspace(1.9, 2.1, len(HZ))
    a = (2j * np.pi * HZ) ** 2 * X * force / 9.80665
    path = text_file(
        tmp_path, rows(HZ * 2 * np.pi, 0 * HZ, a.imag, a.real, force, head="w,coh,im,re,F\n")
    )
    columns = ["frequency_rad_s:w", "real:re", "imaginary:im", "force:F"]
    frf, _ = read_one(path, columns=columns, quantity="accelerance", unit="g", level=None)
    np.testing.assert_allclose(frf.response, X, rtol=1e-12)
    assert frf.force_N == pytest.approx(2.0)


def test_matlab_file_with_repeats(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"f": HZ, "H": 1e6 * np.abs(np.column_stack([X, 1.1 * X]))})
    frfs, _ = read_measured(
        [tmp_path / "run.mat"], settings(columns=["frequency_hz:f", "amplitude:H"])
    )
    np.testing.assert_allclose(
        [f.amplitude for f in frfs], [np.abs(X), 1.1 * np.abs(X)], rtol=1e-12
    )


def universal(path, values, motion=12, node=7, **more):
    import pyuff

    pyuff.UFF(str(path)).write_sets(
        pyuff.prepare_58(
            binary=0,
            func_type=4,
            rsp_node=node,
            rsp_dir=1,
            ref_dir=1,
            ref_node=1,
            data=values,
            x=HZ,
            id1="run",
            rsp_ent_name="NONE",
            ref_ent_name="NONE",
            abscissa_spacing=1,
            abscissa_spec_data_type=18,
            ordinate_spec_data_type=motion,
            orddenom_spec_data_type=13,
            ord_data_type=6,
            abscissa_inc=10.0,
            abscissa_min=HZ[0],
            **more,
        ),
        mode="add",
    )


def test_universal_file(tmp_path):
    path = tmp_path / "run.unv"
    universal(path, (2j * np.pi * HZ) ** 2 * X)
    universal(path, 1.2 * (2j * np.pi * HZ) ** 2 * X)
    frfs, _ = read_measured([path], settings(quantity=None, unit=None))
    # single precision of the file
    np.testing.assert_allclose([f.response for f in frfs], [X, 1.2 * X], rtol=1e-5)
    frf, _ = read_one(path, quantity="accelerance", unit="mm/s2/N", records=[2])
    np.testing.assert_allclose(frf.response, 1.2e-3 * X, rtol=1e-5)


def test_universal_file_written_and_read(tmp_path):
    """At uneven frequencies, which go back where a curve folds; another program (pyuff) sees nodes,
    directions and units."""
    import pyuff

    hz = np.array([2500.0, 2600.25, 2650.5, 2640.125, 2700.0])
    x = np.exp(1j * hz) / hz
    write_universal(tmp_path / "a.unv", [FrfAt("old", hz, x, 1, 1, 1)])
    path = write_universal(
        tmp_path / "a.unv",
        [FrfAt("tip:7, Fe = 1 N", hz, x, 7, 9, -2), FrfAt("tip:8, Fe = 1 N", hz, 2 * x, 8, 9, -2)],
    )
    found = from_universal(path, (1,)) + from_universal(path, (2,))
    for k, (quantity, frequency, response, _, label, factor) in enumerate(found):
        assert (quantity, label, factor) == ("receptance", "m", 1)
        assert frequency == pytest.approx(hz, rel=1e-5)
        assert response == pytest.approx((1 + k) * x, rel=1e-11)
    one, two = pyuff.UFF(str(path)).read_sets()
    assert (one["rsp_node"], one["ref_node"], one["rsp_dir"]) == (7, 9, -2) and two["rsp_node"] == 8
    assert one["func_type"] == 4 and one["orddenom_axis_units_lab"].strip() == "N"
    assert one["id1"].strip() == "tip:7, Fe = 1 N"


def test_universal_file_of_several_places(tmp_path):
    path = tmp_path / "run.unv"
    universal(path, X)
    universal(path, X, node=8)
    with pytest.raises(
        InputError, match="several places .*1: node 7 .*2: node 8.* choose by records"
    ):
        read_measured([path], settings(quantity=None, unit=None))
    with pytest.raises(InputError, match="holds the accelerance, the study says receptance"):
        read_measured([path], settings(records=[1], unit=None))
    with pytest.raises(InputError, match="no dataset 58 number 3, the file has 2"):
        read_measured([path], settings(records=[3], unit=None))


@pytest.mark.parametrize(
    "damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b"\0" * 400]
)
def test_damaged_universal_file(tmp_path, damage):
    path = tmp_path / "run.unv"
    universal(path, X)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=r"run\.unv"):
        read_measured([path], settings(quantity=None, unit=None))


GOOD = [
    ["100", "1", "0"],
    ["110", "2", "-20"],
    ["120", "5", "-90"],
    ["130", "2", "-160"],
    ["140", "1", "-170"],
    ["150", "0.5", "-175"],
]


def changed(row, column, value):
    return (
        "\n".join(
            ",".join(value if (i, j) == (row, column) else v for j, v in enumerate(one))
            for i, one in enumerate(GOOD)
        )
        + "\n"
    )


@pytest.mark.parametrize(
    ("text", "values", "why"),
    [
        (
            changed(9, 9, "").replace(",", ";").replace("0.5", "0,5"),
            {},
            "line 6: 0,5 has a decimal comma; write a point",
        ),
        (changed(2, 1, "x"), {}, "line 3: 'x' is not a number"),
        (changed(2, 1, "5,7"), {}, "line 3: 4 columns, expected 3; .* decimals need a point"),
        (changed(2, 0, "110"), {}, r"110 Hz stands twice \(line 2 and line 3\)"),
        (changed(0, 0, "0"), {}, "line 1: frequency 0 Hz, must be above 0"),
        (changed(2, 1, "-5"), {}, "negative amplitude -5; values in dB"),
        (
            changed(9, 9, ""),
            {"columns": ["frequency_hz", "amplitude", "phase_rad"]},
            "phase_rad reaches 175: .* phase_deg",
        ),
        (
            changed(0, 2, "1"),
            {"columns": ["frequency_hz", "amplitude", "force"], "level": None},
            "per newton, yet",
        ),
        (changed(9, 9, ""), {"level": None}, "level is missing"),
        (changed(9, 9, ""), {"unit": "mm/s/N"}, "not a unit of a receptance; allowed: m, mm, um"),
        (changed(9, 9, ""), {"columns": None}, "columns is missing"),
        ("no numbers here\n", {}, "no row of numbers"),
        ("\n".join(changed(9, 9, "").splitlines()[:3]), {}, "3 points, at least 5"),
        (
            "\n".join(",".join([r[0], "nan", r[2]]) for r in GOOD),
            {},
            rf"0 points, at least 5 are needed; {len(GOOD)} rows are no numbers",
        ),
        (
            "f,a,p\n" + changed(9, 9, ""),
            {"columns": ["frequency_hz:hz", "amplitude:a"]},
            "no column 'hz' in the header",
        ),
    ],
)
def test_bad_text_files(tmp_path, text, values, why):
    path = text_file(tmp_path, text)
    with pytest.raises(InputError, match=why):
        read_one(path, **{"columns": list(POLAR), **values})


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (changed(2, 1, "nan"), r"1 rows are no numbers and are left out \(line 3\)"),
        ("\n".join(reversed(changed(9, 9, "").split())), "do not ascend; the rows are sorted"),
        ("\n".join(",".join([*r[:2], "1.5"]) for r in GOOD), "stays within 1.5 degrees: radians"),
    ],
)
def test_warnings(tmp_path, text, why):
    import re

    frf, (said,) = read_one(text_file(tmp_path, text), columns=list(POLAR))
    assert re.search(why, said)
    assert (np.diff(frf.hz) > 0).all() and len(frf.hz) >= 5


@pytest.mark.parametrize(
    ("columns", "why"),
    [
        (["frequency", "amplitude"], "did you mean|allowed"),
        (["amplitude"], "needs one of frequency_hz"),
        (["frequency_hz", "real"], "go together"),
        (["frequency_hz", "frequency_hz", "amplitude"], "stands twice"),
        (["frequency_hz", "amplitude", "phase_deg", "phase_rad"], "one phase"),
    ],
)
def test_bad_columns(columns, why):
    from pydantic import ValidationError

    with pytest.raises(ValidationError, match=why):
        settings(columns=columns)


@pytest.mark.parametrize(
    "quantity, power", [("receptance", 0), ("mobility", 1), ("accelerance", 2)]
)
def test_a_clipped_signal_has_no_peak_in_any_quantity(tmp_path, quantity, power):
    """Clipped as it was measured: after the division by (i omega)^k its plateau is no longer
    flat."""
    signal = np.abs(X * (2j * np.pi * HZ) ** power)
    path = text_file(tmp_path, rows(HZ, np.minimum(signal, 0.6 * signal.max())))
    unit = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s2/N"}[quantity]
    frf, _ = read_one(path, columns=["frequency_hz", "amplitude"], quantity=quantity, unit=unit)
    assert "clipped" in frf.clipped


def test_complex_variable_of_matlab(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"f": HZ, "H": 1e6 * X})
    frf, _ = read_one(tmp_path / "run.mat", columns=["frequency_hz:f", "complex:H"])
    np.testing.assert_allclose(frf.response, X, rtol=1e-12)
    with pytest.raises(InputError, match="H is complex; columns: 'complex:H'"):
        read_one(tmp_path / "run.mat", columns=["frequency_hz:f", "amplitude:H"])


def test_damaged_matlab_files(tmp_path):
    from scipy.io import savemat

    path, rng = tmp_path / "run.mat", np.random.default_rng(1)
    savemat(path, {"f": HZ, "H": np.abs(X)}, do_compression=True)
    whole = path.read_bytes()
    for _ in range(40):
        broken = bytearray(whole)
        broken[rng.integers(128, len(whole))] ^= 0xFF
        path.write_bytes(broken)
        try:
            read_one(path, columns=["frequency_hz:f", "amplitude:H"])
        except InputError as error:
            assert "run.mat" in str(error)


def test_decimal_commas_between_commas(tmp_path):
    path = text_file(tmp_path, "900,5,5,1234\n901,5,6,1234\n")
    with pytest.raises(InputError, match="4 columns, expected 2; .* decimals need a point"):
        read_one(path, columns=["frequency_hz", "amplitude"])


def test_a_name_that_is_in_the_header_twice(tmp_path):
    path = text_file(tmp_path, "f,x,x\n" + "".join(f"{k},{k},{2 * k}\n" for k in range(1, 9)))
    with pytest.raises(InputError, match="column 'x' is in the header 2 times"):
        read_one(path, columns=["frequency_hz:f", "amplitude:x"])


def test_units_by_their_label(tmp_path):
    path = tmp_path / "run.unv"
    universal(path, 1e3 * X, motion=8, ordinate_axis_units_lab="mm")
    np.testing.assert_allclose(read_one(path, quantity=None, unit=None)[0].response, X, rtol=1e-5)
    other = tmp_path / "other.unv"
    universal(other, X, motion=8, ordinate_axis_units_lab="inch")
    with pytest.raises(InputError, match="labelled 'inch'; state unit = one of m/N"):
        read_one(other, quantity=None, unit=None)


def test_units_by_dataset_164(tmp_path):
    """Of the functions that follow it: mm and mN, then inch and pound force; a label or the study
    overrides it."""
    import pyuff

    def declared(**factors):
        return pyuff.prepare_164(
            units_code=9, units_description="own", temp_mode=1, temp=1.0, temp_offset=0.0, **factors
        )

    path = tmp_path / "run.unv"
    pyuff.UFF(str(path)).write_sets(declared(length=1e3, force=1e3), mode="add")
    universal(path, X, motion=8)
    pyuff.UFF(str(path)).write_sets(declared(length=39.37007874, force=0.2248089431), mode="add")
    universal(path, X, motion=8)
    universal(path, X, motion=8, ordinate_axis_units_lab="um")
    found, _ = read_measured([path], settings(quantity=None, unit=None))
    for frf, factor in zip(found, (1.0, 0.0254 / 4.4482216, 1e-6), strict=True):
        np.testing.assert_allclose(frf.response, factor * X, rtol=1e-5)
    inch = read_one(path, quantity="receptance", unit="mm/N", records=[2])[0]
    np.testing.assert_allclose(inch.response, 1e-3 * X, rtol=1e-5)


def test_repeats_at_different_levels(tmp_path):
    files = [
        text_file(
            tmp_path, rows(HZ, np.abs(X), np.full(len(HZ), level), head=""), f"run_{level}.csv"
        )
        for level in (1, 20)
    ]
    with pytest.raises(
        InputError, match="different levels: .*run_1.csv at 1 N, .*run_20.csv at 20 N"
    ):
        read_measured(
            files, settings(columns=["frequency_hz", "amplitude", "force"], unit="um", level=None)
        )


@pytest.mark.parametrize("amplitude", [1e308, 1e100])
def test_an_amplitude_that_nothing_measures(tmp_path, amplitude):
    """Squares of it overflow."""
    size = 1e6 * np.abs(X)
    size[7] = amplitude
    text = rows(HZ, size, np.degrees(np.angle(X)))
    with pytest.raises(InputError, match=r"run\.csv: .*line 9: amplitude 1e\+.* nothing measures"):
        read_one(text_file(tmp_path, text), columns=list(POLAR))
