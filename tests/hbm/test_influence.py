"""What a peak depends on: pictures, tables and files."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.modes.test_derivatives import BAND, chain, peak
from tipdamp import (
    Derivatives,
    DryFriction2T,
    ForcedResponse,
    Hold,
    InputError,
    forced_response,
)
from tipdamp.hbm.example import two_blades


@pytest.fixture(scope="module")
def by():
    return peak(chain())


def ends(axes):
    """Of the bars, from the lowest one on."""
    bars = [bar.get_path().vertices[:, 0] for bar in axes.patches]
    return [bar[np.abs(bar).argmax()] for bar in bars]


def test_a_tornado_has_the_largest_on_top(by):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    axes = by.plot()
    names = [label.get_text() for label in axes.get_yticklabels()]
    sizes = [abs(by.total(name)[1]) for name in names]
    assert sizes == sorted(sizes) and set(names) == set(by.amplitude_by)
    assert np.allclose(ends(axes), [by.total(name)[1] / by.amplitude for name in names])
    axes = by.plot("mu", of="frequency")
    assert [label.get_text() for label in axes.get_yticklabels()] == ["contact 1", "contact 0"]
    assert np.allclose(ends(axes), by.frequency_by["mu"][::-1] / by.frequency)
    pyplot.close("all")


def test_a_table(by):
    pytest.importorskip("pandas")
    table = by.to_pandas().set_index(["setting", "contact"])
    assert table.loc[("mu", 0), "amplitude_percent"] == by.amplitude_by["mu"][0] / by.amplitude
    assert len(table) == 4 * 2 + 2


def test_saved_and_loaded(by, tmp_path):
    again = Derivatives.load(by.save(tmp_path / "by.npz"))
    assert (again.frequency, again.amplitude) == (by.frequency, by.amplitude)
    for name, part in by.amplitude_by.items():
        assert np.array_equal(again.amplitude_by[name], part)
        assert np.array_equal(again.frequency_by[name], by.frequency_by[name])
    assert again == by != replace(by, amplitude=1.0)


def test_a_curve_keeps_those_that_were_asked_for(by, tmp_path):
    given = dict(outputs={"tip": 2}, harmonics=5, truncation=False)
    curve = chain().follow_band(BAND, derivatives=["tip"], **given)
    assert curve.derivatives == {"tip": by}
    again = ForcedResponse.load(curve.save(tmp_path / "curve.npz"))
    assert again == curve and again.derivatives == {"tip": by}
    with pytest.warns(UserWarning, match="derivatives of 'tip': peak .* border of the band"):
        low = chain().follow_band((0.06, 0.1), derivatives=["tip"], **given)
    assert low.derivatives == {}
    for wrong, said in ((["tap"], "derivatives: output 'tap'"), ("tip", "must be names")):
        with pytest.raises(InputError, match=said):
            chain().follow_band(BAND, derivatives=wrong, **given)


def two_pairs(weight):
    """(curve with its derivatives, table) of two blades, of whose pairs the right one may be
    detached."""
    model, pairs = two_blades()
    pairs = pairs.replace(weight=[1.0, weight])
    tip = model.displacement_row("blade1", 1, [0, 1, 0])
    given = dict(damping_ratio=0.01, outputs={"tip": tip}, harmonics=1, truncation=False)
    law, asked = DryFriction2T(), dict(derivatives=["tip"], hold=Hold("y"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a blade without contact
        return forced_response(model, pairs, law, 20 * tip, (650, 720), **given, **asked), pairs


@pytest.mark.parametrize("weight", [1.0, 0.0])
def test_a_map_of_the_pairs(weight):
    """Disks where the pairs stand, by their area; a detached pair changes nothing."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    curve, pairs = two_pairs(weight)
    by = curve.derivatives["tip"]
    axes = by.map(pairs.replace(position=[[0.01, 0, 0.03], [0.02, 0, 0.0]]), "kt")
    disks = axes.lines[1::2]  # each on the dot of its pair
    assert np.allclose([line.get_xydata()[0] for line in disks], [[30, 10], [0, 20]])
    sizes = np.array([line.get_markersize() for line in disks])
    values = by.relative("kt")
    assert np.allclose(sizes**2 / sizes.max() ** 2, np.abs(values) / np.abs(values).max())
    assert (values[1] == 0) == (weight == 0)
    pyplot.close("all")


def test_bad_input_is_one_line(by, tmp_path):
    with pytest.raises(InputError, match="setting 'muu': must be one of"):
        by.plot("muu")
    with pytest.raises(InputError, match="of = 'height': must be 'amplitude' or 'frequency'"):
        by.plot(of="height")
    with pytest.raises(InputError, match="pairs = 3: must be"):
        by.map(3)
    with pytest.raises(InputError, match="pairs: has 1, 'mu' is of 2; give the table"):
        by.map(two_blades()[1].select([0]))
    with pytest.raises(InputError, match="derivatives not found"):
        Derivatives.load(tmp_path / "none.npz")
    np.savez(tmp_path / "other.npz", x=1)
    with pytest.raises(InputError, match="is not what Derivatives.save writes"):
        Derivatives.load(tmp_path / "other.npz")
