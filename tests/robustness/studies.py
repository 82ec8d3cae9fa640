"""C. Study files and parameters."""

import json

import numpy as np

from tests.robustness.rows import (
    accepted,
    arrays,
    cells,
    chain,
    corner,
    refused,
    row,
    stages,
    tipdamp,
    warned,
)
from tipdamp.engine.store import Store
from tipdamp.hbm.result import ForcedResponse
from tipdamp.stages.run import STAGES


def result(study, name):
    return json.loads((study.parent / "results" / study.stem / f"{name}.json").read_text())


@row("38", "unknown key", "E")
def unknown(folder):
    yield refused(
        chain(folder, ("pull = 60", "pul = 60")),
        r"\[model\] unknown key 'pul'; did you mean 'pull'",
    )
    yield refused(chain(folder, add="[tunne]\n"), "unknown key 'tunne'; did you mean 'tune'")


@row("39", "number traps: 3.02e6, 0,6, on, 0123, 1:30", "S, E")
def traps(folder):
    assert accepted(chain(folder, ("pull = 60", "pull = 6.0e1"))).code == 0
    yield "3.02e6 and 1e6 are numbers"
    yield refused(chain(folder, ("= 0.01", "= 0,01")), "numbers take a decimal point, 0.01")
    yield refused(chain(folder, ("= 0.01", "= [0,3]")), "damping_ratio|0.3 meant")
    yield refused(chain(folder, ("levels = [5]", "levels = [0,3]")), "is 0.3 meant")
    for text in ("on", "0123", "1:30"):
        yield refused(
            chain(folder, ("pull = 60", f"pull = {text}")), "not a valid TOML file: .*line 5"
        )


@row("40", "duplicate key", "E")
def duplicate(folder):
    yield refused(
        chain(folder, ("pull = 60", "pull = 60\npull = 70")), "Cannot overwrite a value .*line 6"
    )


@row("41", "NaN, Infinity, 1e999", "E")
def not_finite(folder):
    for text in ("nan", "inf", "1e999", "1" + "0" * 400):
        yield refused(
            chain(folder, ("pull = 60", f"pull = {text}")), r"\[model\] pull = .*: must be"
        )


@row("42", "missing or unknown unit", "E")
def units(folder):
    yield refused(
        chain(folder, add='[units]\nforce = "kg"\n'), r"\[units\] force = 'kg': .*valid: N, kN"
    )
    yield refused(chain(folder, ("pull = 60", 'pull = "5 kg"')), r"pull = '5 kg': must be a number")


@row("43", "mu = 0", "S")
def frictionless(folder):
    stages(cells(chain(folder), "mu", 0), "respond")
    curve = ForcedResponse.load(folder / "results" / "study" / "responses" / "Fe_5N_H1.npz")
    assert curve.complete and curve.dissipated.max() < 1e-12 * curve.amplitude().max() * 5
    yield "a complete curve; the contacts take out no energy"


@row("44", "mu < 0, mu > 2", "E, W")
def odd_mu(folder):
    yield refused(
        corner(folder, ("mu = 0.3", "mu = -0.1")), r"\[contact\] mu = -0.1: must be at least 0"
    )
    yield warned(corner(folder, ("mu = 0.3", "mu = 2.5")), r"\[contact\] mu = 2.5 is above 2")


@row("45", "Fe = 0", "E")
def no_force(folder):
    yield refused(
        chain(folder, ("levels = [5]", "levels = [0]")), r"levels = \[0\]: must be above 0"
    )


@row("46", "Fc = 0: no preload", "E, W")
def no_pull(folder):
    yield refused(chain(folder, ("pull = 60", "pull = 0")), r"pull = 0: must be above 0")
    study = cells(chain(folder), "gap", 1e-3)
    said = tipdamp("run", study, "--quiet", "--jobs", "1")
    assert said.code in (2, 3) or "warning: " in said.out, said
    yield said.line[:300]


@row("48", "no active contact pairs", "E")
def no_pairs(folder):
    study = chain(folder)
    path = folder / "pairs.csv"
    path.write_text(path.read_text().splitlines()[0] + "\n")
    yield refused(study, "holds no contact pairs")
    for verb in ("inspect", "reduce", "preload"):
        said = tipdamp(verb, cells(chain(folder), "weight", 0), "--quiet")
        if said.code:
            break
    assert said.code == 2, said
    yield said.line[:300]


@row("50", "H = 0, negative, 500; few samples", "E")
def harmonics(folder):
    for H in ("0", "-1", "500", "2.5"):
        yield refused(
            chain(folder, ("harmonics = [1]", f"harmonics = [{H}]")),
            "harmonics = .*(between 1 and 99|wh)",
        )


@row("51", "band empty, reversed, from 0, negative", "E")
def bands(folder):
    for band in ("[900, 900]", "[1400, 900]", "[0, 900]", "[-5, 900]"):
        yield refused(chain(folder, ("[900, 1400]", band)), r"\[respond\] band = ")


@row("52", "band without any resonance", "W")
def no_resonance(folder):
    study = chain(folder, ("[900, 1400]", "[100, 300]"))
    stages(study, "tune")
    yield warned(study, r"band = 100 to 300 Hz.*no stuck mode|peak", "tune")
    accepted(study, "respond")
    found = result(study, "respond")["responses"][0]
    assert found["peak_hz"] is None and found["peak_m"] is None and found["at_least_hz"] == 300
    yield warned(
        study,
        "has no peak inside the band: .* at 300.0 Hz; the nearest stuck mode has 1071",
        "respond",
    )


@row("54", "target frequency that cannot be reached", "E")
def unreachable(folder):
    study = chain(folder, ("stations = [1, 1]", "target_hz = 9000"))
    stages(study, "preload")
    yield refused(
        study, r"target 9000 Hz is not reachable: 1844..2171 Hz with 2..3 stations", verb="tune"
    )


@row("56", "duplicate names, names with a slash", "E")
def names(folder):
    yield refused(
        chain(folder, add="[loads.a]\npull = 1\n[loads.a]\npull = 2\n"), "Cannot declare .*twice"
    )
    yield refused(
        chain(folder, add='[loads."a/../b"]\npull = 1\n'), "is named by letters, digits, - and _"
    )
    yield refused(chain(folder, ("levels = [5]", "levels = [5, 5.0]")), "levels: 5 is given twice")


@row("57", "very many cases", "E")
def many(folder):
    levels = ", ".join(str(k) for k in range(1, 1002))
    yield refused(
        chain(folder, ("levels = [5]", f"levels = [{levels}]")),
        "2002 curves, at most 1000 .* h and .* GB",
    )
    levels = ", ".join(f"{1 + 1e-3 * k:.4f}" for k in range(100_000))
    yield refused(
        chain(folder, ("levels = [5]", f"levels = [{levels}]")),
        "has 100000 items, at most 10000 are read",
    )


MEASURED = (
    '[measured.a]\nfiles = "a.csv"\ncolumns = ["frequency_hz", "amplitude"]\nquantity = '
    '"receptance"\nunit = "m/N"\nlevel = 5\n'
)
HZ = np.linspace(950, 1350, 41)
SIZE = 1e-6 / np.abs(1 - (HZ / 1071) ** 2 + 0.02j * HZ / 1071)


def measured(folder, text, study=None):
    study = study or chain(folder, add=MEASURED)
    (folder / "a.csv").write_bytes(text.encode("utf-8-sig" if text.startswith("#bom") else "utf-8"))
    return study


@row("58", "measured data: columns, comma, order, NaN, BOM", "E, W, S")
def measured_files(folder):
    good = "\n".join(f"{f:.6f},{a:.6e}" for f, a in zip(HZ, SIZE, strict=True)) + "\n"
    plain = accepted(measured(folder, good), "measured").out.split("\n")[0].split("  ")[-1]
    for text in ("#bom\n" + good, good.replace("\n", "\r\n")):
        assert (
            accepted(measured(folder, text), "measured").out.split("\n")[0].split("  ")[-1] == plain
        )
    yield "BOM and Windows line ends: the same curve"
    lines = good.splitlines()
    yield warned(
        measured(folder, good.replace(lines[5], "1000.0,nan", 1)),
        r"left out \(line 6\)",
        "measured",
    )
    yield refused(measured(folder, good.replace(lines[5], "1000.0", 1)), "line 6", verb="measured")
    yield refused(
        measured(folder, good.replace(lines[5], "1.000,5;0,3", 1)), "line 6|comma", verb="measured"
    )
    said = tipdamp(
        "measured", measured(folder, "\n".join(reversed(lines)) + "\n"), "--quiet", "--force"
    )
    assert said.code == 2 or "sorted" in said.out, said
    yield said.line[:300]
    yield refused(
        measured(folder, "\n".join([*lines[:4], lines[3], *lines[4:]]) + "\n"),
        "twice|same|ascend|line",
        verb="measured",
    )


@row("59", "measured curve beside the computed band", "E, W")
def no_overlap(folder):
    text = "\n".join(f"{f - 850:.6f},{a:.6e}" for f, a in zip(HZ, SIZE, strict=True)) + "\n"
    study = measured(folder, text)
    said = tipdamp("run", study, "--quiet", "--jobs", "1")
    assert "no overlap" in said.out + said.err or "overlap" in said.out + said.err, said
    yield next(line for line in (said.out + said.err).splitlines() if "overlap" in line)[:300]


@row("61", "half-power of a truncated peak", "E, W")
def truncated_peak(folder):
    text = "\n".join(f"{f:.6f},{a:.6e}" for f, a in zip(HZ, SIZE, strict=True) if f < 1075) + "\n"
    said = tipdamp("measured", measured(folder, text), "--quiet")
    assert "no half-power point" in said.out + said.err or "peak" in said.out + said.err, said
    found = result(folder / "study.toml", "measured") if said.code == 0 else {}
    yield said.line[:300] or str(found)[:300]


@row("x2", "TOML nested 100000 deep, keys of 100000 parts, a file of 2 MB, 100000 digits", "E")
def nested(folder):
    yield refused(
        chain(folder, add="a = " + "[" * 100_000 + "]" * 100_000), "lie in one another too deeply"
    )
    yield refused(
        chain(folder, add="[" + "a." * 100_000 + "b]\nx = 1\n"),
        "line 20: a key of 16 parts or more",
    )
    yield refused(chain(folder, add="#" * 2_000_000), "at most 1000000 are read")
    yield refused(
        chain(folder, ("pull = 60", "pull = " + "6" * 100_000)),
        "a whole number has thousands of digits",
    )


@row("x3", "study file in latin-1", "E")
def latin(folder):
    study = chain(folder)
    study.write_bytes('title = "Prüfling"\n'.encode("latin-1") + study.read_bytes())
    yield refused(study, "line 1: the byte 0xfc is not UTF-8.*iconv -f latin1 -t utf-8 study.toml")


@row("x4", "numbers that no solid has", "E")
def absurd(folder):
    for old, new in (
        ("density = 7850", "density = 1e-300"),
        ("E = 207e9", "E = 1e300"),
        ("pull = 10", "pull = 1e300"),
        ("kn = 1e6", "kn = 1e-300"),
    ):
        yield refused(corner(folder, (old, new)), "in SI units, must be between")


@row("x5", "ground spring on a free damper", "W")
def grounded(folder):
    def change(K):
        K = K.copy()
        K[20, 20] += 1e5  # z of the damper, against the pull
        return K

    yield warned(
        arrays(chain(folder), K=change), r"damper's own K resists .* along .*z \(1e\+05 N/m"
    )


@row("x6", "repeated modes of the blades", "W")
def repeated(folder):
    study = corner(folder)
    accepted(study)
    yield warned(study, "free modes have the same frequency", "reduce")


@row("x7", "forces that are zero to rounding", "S")
def negative_zero(folder):
    study = chain(folder)
    stages(study, "preload")
    store = folder / "results" / "study" / "preload.json"
    found = json.loads(store.read_text())
    for side in found["sides"].values():
        side["min_N"] = -1e-12
    store.write_text(json.dumps(found))
    text = STAGES["preload"].line(Store(store.parent))
    assert "-0.00" not in text and "0.00.." in text, text
    yield text
