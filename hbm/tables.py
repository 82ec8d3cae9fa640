"""Results as tables: of pandas and xarray, and as notebooks show them."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import library

if TYPE_CHECKING:
    import pandas
    import xarray
    from pandas.core.frame import DataFrame

    from tipdamp.hbm.result import ForcedResponse


SHARES = ("share_stick", "share_slip", "share_open")  # of the cycle
UNITS = {
    **dict.fromkeys(("amplitude", "height", "harmonics", "shape"), "m"),
    "frequency": "Hz",
    "friction_W": "W",
    "modal_amplitude": "kg^(1/2) m",
}


def as_frame(curve: ForcedResponse, kind: str, order: int | None) -> pandas.DataFrame:
    """A row for each point: see `ForcedResponse.to_pandas`."""
    amplitude = curve.amplitude(kind, order)
    columns: dict[str, Any] = {"frequency": curve.frequency}
    if curve.parameter_name != "frequency":
        columns[curve.parameter_name] = curve.parameter
    columns |= {name: amplitude[:, j] for j, name in enumerate(curve.output_names.tolist())}
    columns |= {"dissipated": curve.dissipated.sum(axis=1), "converged": curve.converged}
    if curve.multipliers.size:
        known = curve.stable | curve.unstable
        columns["stable"] = [
            bool(s) if k else None for s, k in zip(curve.stable, known, strict=True)
        ]
    if curve.truncation.size:
        columns["relative_truncation"] = curve.relative_truncation
    return frame(columns, "point")


def as_dataset(curve: ForcedResponse) -> xarray.Dataset:
    """All arrays by point, output, harmonic and contact: see `ForcedResponse.to_xarray`."""
    held = {
        "harmonics": (("point", "output", "harmonic"), "m"),
        **dict.fromkeys(SHARES, (("point", "contact"), "1")),
        "dissipated": (("point", "contact"), "J"),
        "truncation": (("point", "output"), "m"),
        "multipliers": (("point", "multiplier"), "1"),
        "contact_force": (("point", "contact", "component", "harmonic"), "N"),
        "converged": (("point",), "1"),
    }
    data = {name: (dims, vars(curve)[name], unit) for name, (dims, unit) in held.items()}
    data["amplitude"] = (("point", "output"), curve.amplitude(), "m")
    places = {
        "frequency": ("point", curve.frequency, {"units": "Hz"}),
        "output": curve.output_names,
        "harmonic": np.arange(curve.H + 1),
    }
    if curve.parameter_name != "frequency":
        places[curve.parameter_name] = ("point", curve.parameter)
    about = {"ended": curve.ended, "complete": int(curve.complete), "periods": curve.periods}
    return dataset(data, places, **about)


class Places(Protocol):
    """What a branch has beside its arrays by place: a Backbone, or what was followed."""

    @property
    def H(self) -> int:
        """Harmonics."""

    @property
    def ended(self) -> str:
        """Why it ends."""

    @property
    def complete(self) -> bool:
        """Whether it has all places that were asked for."""


def places_as_dataset(branch: Places) -> xarray.Dataset:
    """All arrays by place, output, harmonic, contact and dof: see `Backbone.to_xarray`."""
    dims = {
        "harmonics": ("place", "output", "harmonic"),
        "shape": ("place", "dof"),
        "unknowns": ("place", "unknown"),
    }
    arrays = {name: a for name, a in vars(branch).items() if isinstance(a, np.ndarray)}
    outputs = {name: arrays.pop(name) for name in ("output_names", "output_rows") if name in arrays}
    data = {
        name: (dims.get(name, ("place", "contact")[: a.ndim]), a, UNITS.get(name, "1"))
        for name, a in arrays.items()
    }
    places = {"output": outputs["output_names"], "harmonic": np.arange(branch.H + 1)}
    return dataset(data, places, ended=branch.ended, complete=int(branch.complete))


def dataset(
    data: Mapping[str, tuple[tuple[str, ...], np.ndarray, str]],
    places: Mapping[str, Any],
    **about: Any,
) -> xarray.Dataset:
    """{name: (dimensions, values, unit)} by {dimension: its labels}, without what has no values,
    and without the shares of the cycle where nothing is a contact; InputError where xarray is not
    installed."""
    shares = [data[name][1] for name in SHARES if name in data]
    if shares and not in_contact(*shares).any():
        data = {name: of for name, of in data.items() if name not in SHARES}
    held = {name: (dims, a, {"units": unit}) for name, (dims, a, unit) in data.items() if a.size}
    return library("xarray", "to_xarray").Dataset(held, coords=places, attrs=about)


def in_contact(stick: np.ndarray, slip: np.ndarray, opened: np.ndarray) -> np.ndarray:
    """(P,) bool, which are contacts, by the shares of the cycle, each (P,) or (n, P): all are 0 of
    a force that is none; true where no point is known."""
    total = np.atleast_2d(stick + slip + opened)
    return (np.nansum(total, axis=0) != 0) | np.isnan(total).all(axis=0)


def notebook_table(caption: str, rows: Mapping[str, str]) -> str:
    """For a notebook: HTML of a caption and rows {what: value}, all of them plain text."""
    body = "".join(
        f"<tr><th style='text-align:left'>{escape(what)}</th>"
        f"<td style='text-align:left'>{escape(value)}</td></tr>"
        for what, value in rows.items()
    )
    return f"<table><caption><b>{escape(caption)}</b></caption>{body}</table>"


def frame(columns: Mapping[str, ArrayLike], index: str) -> DataFrame:
    """{title: column} as a table with a named index; InputError where pandas is not installed."""
    made = library("pandas", "to_pandas").DataFrame(columns)
    made.index.name = index
    return made
