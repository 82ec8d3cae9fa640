"""Modes: the linear response of both blades without damper; the shapes of the bodies alone and of
the stuck assembly, animated on their surfaces."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm.drawing.figure import BLUE, GREY, INK, VERMILION, Curve, Figure, Line, Panel
from tipdamp.hbm.model import ReducedModel
from tipdamp.report.drawing.moving import MovingBodies, PeriodicMotion
from tipdamp.report.drawing.scene import view
from tipdamp.report.results import Results
from tipdamp.report.subjects.surroundings import view_of
from tipdamp.report.text import MM, hertz, listing
from tipdamp.study.view import Study

STILL = 1e-6  # of the largest amplitude: less is a blade that nothing excites
STYLES = ((BLUE, "solid"), (VERMILION, "dash"))
LARGEST = 0.06  # drawn displacement over the size of what moves


def free_response(results: Results) -> Iterator[Figure]:
    """One figure, where the study has response patches."""
    if results.reduce is None or results.reduce.free_response is None:
        return
    response, free = results.reduce.free_response, results.reduce.free_hz
    hz = np.array(response.hz, dtype=float)
    curves = [
        Curve(hz, np.array(y, dtype=float), f"blade {k + 1} ({patch})", *style)
        for k, ((patch, y), style) in enumerate(zip(response.m_per_N.items(), STYLES, strict=False))
    ]
    highest = max(c.y.max() for c in curves)
    moving = [c for c in curves if c.y.max() > STILL * highest]
    still = "".join(
        f" Not shown: {c.name}, which the excitation does not reach (less than {STILL:g} of the "
        "other)."
        for c in curves
        if c.y.max() <= STILL * highest
    )
    lines = [
        line for line in _lines(free, results.study.reference) if hz[0] <= line.value <= hz[-1]
    ]
    where = (
        f"Out of phase the blades vibrate at {hertz(free['out_of_phase'])} Hz, in phase at "
        f"{hertz(free['in_phase'])} Hz."
        if free
        else "No mode involves both blades."
    )
    yield Figure(
        "linear_without_damper",
        "Response without damper",
        "Linear response of the two blades without damper to the excitation of Fe = 1 N: largest "
        f"amplitude over each response patch, {_damping(results.study)}. {where}{still}"
        + results.beside_paper("Corresponds to figure 2"),
        [
            Panel(
                "",
                "frequency (Hz)",
                "amplitude per force (m/N)",
                [*moving, *lines],
                log_y=True,
                x_range=(hz[0], hz[-1]),
                y_range=(0.7 * min(c.y.min() for c in moving), 3 * highest),
            )
        ],
        columns=1,
    )


def _damping(study: Study) -> str:
    """Of the blades without damper, and where it is stated if that of the response is another."""
    zetas = study.free.damping_ratio
    other = "respond" in study and study.respond.damping_ratio not in ((), zetas)
    said = listing(f"{100 * z:g} %" for z in zetas)
    return (
        f"damping ratio {said}" + " as [free] damping_ratio has it, not that of [respond]" * other
    )


def _lines(free: Mapping[str, float], reference: Mapping[str, float]) -> Iterator[Line]:
    """The named modes, and their reference values."""
    for name, hz in free.items():
        left = hz == min(free.values())
        yield Line("x", hz, f"{name.replace('_', ' ')} {hertz(hz)} Hz", INK, "dot", left=left)
        given = reference.get(f"{name}_hz")
        if given:
            yield Line("x", given, f"reference {given:g} Hz", GREY, "dash", "low", left)


def shapes(results: Results) -> Iterator[MovingBodies]:
    """One picture with a choice of modes; none where the study has no meshes."""
    if not results.surfaces or results.model is None:
        return
    modes = list(_modes(results, results.model))
    if modes:
        seen = (
            view_of(results.whole, results.axis)
            if results.whole is not None
            else view((0.0, 0.0, 1.0), results.axis)
        )
        yield MovingBodies(
            "mode_shapes",
            "Mode shapes",
            "Shapes on the surfaces of the meshes, recovered from the reduced model. Colour: "
            "displacement over its largest value; thin lines: sharp edges at rest. All bodies are "
            "magnified alike. Drag to turn.",
            results.surfaces,
            modes,
            next((i for i, m in enumerate(modes) if "tracked" in m.label), 0),
            *seen,
        )


def _modes(results: Results, model: ReducedModel) -> Iterator[PeriodicMotion]:
    """The modes in the order of the list, recovered on the surfaces."""
    dofs = {body: model.body == body for body in results.surfaces}
    for some in results.shapes:
        for kind, label, hz, q in zip(
            some.kind.tolist(), some.label.tolist(), some.hz.tolist(), some.q.T, strict=True
        ):
            moving = {body: s for body, s in results.surfaces.items() if q[dofs[body]].any()}
            moved = {body: s.displacement(q[dofs[body]]) for body, s in moving.items()}
            largest = max(
                (float(np.linalg.norm(u, axis=1).max()) for u in moved.values()), default=0.0
            )
            if largest > 0:
                shapes = {body: u / np.float32(largest) for body, u in moved.items()}
                yield PeriodicMotion(
                    kind,
                    label,
                    hz,
                    (1,),
                    {body: u[None] for body, u in shapes.items()},
                    drawn_amplitude(moving.values()),
                    {body: np.linalg.norm(u, axis=1) for body, u in shapes.items()},
                )


def drawn_amplitude(moving: Iterable[OuterSurface]) -> float:
    """mm for the largest displacement of bodies of this size."""
    size = np.ptp(np.concatenate([one.position for one in moving]), axis=0)
    return LARGEST * MM * float(np.linalg.norm(size))
