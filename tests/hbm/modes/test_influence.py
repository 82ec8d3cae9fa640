"""What a peak depends on: pictures, tables and files."""

import numpy as np
import pytest

from tests.hbm.modes.test_derivatives import chain, peak
from tipdamp import Derivatives, InputError


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


def test_bad_input_is_one_line(by, tmp_path):
    with pytest.raises(InputError, match="setting 'muu': must be one of"):
        by.plot("muu")
    with pytest.raises(InputError, match="of = 'height': must be 'amplitude' or 'frequency'"):
        by.plot(of="height")
    with pytest.raises(InputError, match="derivatives not found"):
        Derivatives.load(tmp_path / "none.npz")
    np.savez(tmp_path / "other.npz", x=1)
    with pytest.raises(InputError, match="is not what Derivatives.save writes"):
        Derivatives.load(tmp_path / "other.npz")
