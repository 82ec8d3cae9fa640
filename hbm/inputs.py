"""What comes through the door of the forced response, checked before anything heavy starts."""

import numpy as np

from hbm.errors import InputError

MOST_HARMONICS = 200
MOST_SAMPLES = 2**16


def check_harmonics(H):
    if isinstance(H, bool) or not isinstance(H, int | np.integer) or not 0 <= H <= MOST_HARMONICS:
        raise InputError(f"harmonics = {H!r}: must be a whole number between 0 and {MOST_HARMONICS}")
    return int(H)


def check_band(band):
    try:
        first, last = (float(b) for b in band)
    except (TypeError, ValueError):
        raise InputError(f"band = {band!r}: must be two frequencies in Hz, (from, to)") from None
    if not (np.isfinite(first) and np.isfinite(last) and first > 0 and last > 0) or first == last:
        raise InputError(f"band = ({first:g}, {last:g}) Hz: both must be positive, and different")
    return first, last


def check_samples(samples, H):
    """None stays None: the law's own number."""
    least = max(8, 4 * H)
    whole = isinstance(samples, int | np.integer) and not isinstance(samples, bool)
    if samples is not None and not (whole and least <= samples <= MOST_SAMPLES):
        raise InputError(f"samples = {samples!r}: must be a whole number, at least {least} for harmonics = {H}, and at "
                         f"most {MOST_SAMPLES}")
    return samples


def check_at(at):
    """(k,) Hz."""
    try:
        values = np.atleast_1d(np.asarray(at, dtype=float)).ravel()
    except (TypeError, ValueError):
        raise InputError(f"at = {at!r}: must be frequencies in Hz") from None
    if not (np.isfinite(values).all() and (values > 0).all()):
        raise InputError(f"at = {at!r}: frequencies in Hz must be finite and positive")
    return values


def check_forcing(forcing, r, H):
    forces = forcing if isinstance(forcing, dict) else {1: forcing}
    checked = {}
    for k, F in forces.items():
        F = np.asarray(F)
        if not isinstance(k, int | np.integer) or not 0 < k:
            raise InputError(f"forcing of harmonic {k!r}: harmonics count from 1; constant loads go into `static`")
        if k > H:
            raise InputError(f"forcing of harmonic {k}: harmonics = {H} keeps orders 0..{H} only")
        if F.shape != (r,) or not np.isfinite(F).all():
            raise InputError(f"forcing of harmonic {k}: must be finite with shape ({r},), got shape {F.shape}")
        checked[int(k)] = F
    return checked


def check_outputs(outputs, r):
    if not outputs:
        raise InputError("outputs: at least one {name: row} is needed")
    rows = []
    for name, row in outputs.items():
        row = row.toarray().ravel() if hasattr(row, "toarray") else np.asarray(row, dtype=float)
        if row.shape != (r,) or not np.isfinite(row).all():
            raise InputError(f"output '{name}': must be a finite row of length {r}, got shape {row.shape}")
        rows.append(row)
    return list(outputs), np.array(rows)
