"""Results as tables: of pandas and xarray, and as notebooks show them."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm.errors import library

if TYPE_CHECKING:
    import pandas
    import xarray

    from tipdamp.hbm.result import ForcedResponse


def as_frame(curve: ForcedResponse, kind: str, order: int | None) -> pandas.DataFrame:
    """A row for each point: see `ForcedResponse.to_pandas`."""
    pandas = library("pandas", "to_pandas")
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
    frame = pandas.DataFrame(columns)
    frame.index.name = "point"
    return frame


def as_dataset(curve: ForcedResponse) -> xarray.Dataset:
    """All arrays by point, output, harmonic and contact: see `ForcedResponse.to_xarray`."""
    xarray = library("xarray", "to_xarray")
    held = {
        "harmonics": (("point", "output", "harmonic"), "m"),
        "share_stick": (("point", "contact"), "1"),
        "share_slip": (("point", "contact"), "1"),
        "share_open": (("point", "contact"), "1"),
        "dissipated": (("point", "contact"), "J"),
        "truncation": (("point", "output"), "m"),
        "multipliers": (("point", "multiplier"), "1"),
        "contact_force": (("point", "contact", "component", "harmonic"), "N"),
    }
    data = {
        name: (dims, vars(curve)[name], {"units": unit})
        for name, (dims, unit) in held.items()
        if vars(curve)[name].size
    }
    data["amplitude"] = (("point", "output"), curve.amplitude(), {"units": "m"})
    data["converged"] = (("point",), curve.converged, {})
    places = {
        "frequency": ("point", curve.frequency, {"units": "Hz"}),
        "output": curve.output_names,
        "harmonic": np.arange(curve.H + 1),
    }
    if curve.parameter_name != "frequency":
        places[curve.parameter_name] = ("point", curve.parameter)
    about = {"ended": curve.ended, "complete": int(curve.complete), "periods": curve.periods}
    return xarray.Dataset(data, coords=places, attrs=about)


def notebook_table(caption: str, rows: Mapping[str, str]) -> str:
    """For a notebook: HTML of a caption and rows {what: value}, all of them plain text."""
    body = "".join(
        f"<tr><th style='text-align:left'>{escape(what)}</th>"
        f"<td style='text-align:left'>{escape(value)}</td></tr>"
        for what, value in rows.items()
    )
    return f"<table><caption><b>{escape(caption)}</b></caption>{body}</table>"
