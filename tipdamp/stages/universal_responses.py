"""The computed responses of a study as universal file, for programs of modal analysis:
`tipdamp export study.toml --format unv`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.measured.universal import FrfAt, write_universal
from tipdamp.results.response_results import RespondResult, families
from tipdamp.stages.run import command
from tipdamp.statics.model_inputs import group
from tipdamp.study.view import Study

FILE = "export/responses.unv"


def write_responses(study: Study, store: Store) -> Path:
    """Of the curves of the largest H at every node of the patches: what moves at the frequency of
    the force, per newton. Raises InputError where nothing was responded."""
    if not store.path(RespondResult.file).is_file():
        raise InputError(
            f"{study.path}: no responses to export yet; run: {command('respond', study, store)}"
        )
    axis = _axis(study.respond.direction)
    driven = _driven_node(study, ReducedModel.load(store.path("model.npz")))
    functions = []
    for case in families(RespondResult.load(store).responses)[-1]:
        curve = ForcedResponse.load(store.path(case.file))
        for k, name in enumerate(curve.output_names):
            functions.append(
                FrfAt(
                    title=f"{name}, Fe = {case.Fe_N:g} N, H = {case.H}",
                    hz=curve.frequency,
                    response=curve.harmonics[:, k, 1] / case.Fe_N,
                    response_node=int(name.rpartition(":")[2]),
                    force_node=driven,
                    direction=axis,
                )
            )
    store.path("export").mkdir(exist_ok=True)
    return write_universal(store.path(FILE), functions)


def _axis(direction: Sequence[float]) -> int:
    """1, 2, 3 along x, y, z, negative against it, and 0 of a direction between them."""
    unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    k = int(np.abs(unit).argmax())
    return int(np.sign(unit[k])) * (k + 1) if abs(unit[k]) > 1 - 1e-9 else 0


def _driven_node(study: Study, model: ReducedModel) -> int:
    """Its number, or 0 where several nodes share the force."""
    nodes = [n for name in study.respond.excitation for n in group(model, study, name)]
    return int(nodes[0]) if len(nodes) == 1 else 0
