"""Figure: mode shapes of the stuck assembly and of the bodies alone, animated on their surfaces."""

from collections.abc import Iterator

import numpy as np

from tipdamp.report.drawing.modes import Mode, ModeShapes
from tipdamp.report.drawing.scene import view
from tipdamp.report.figures.surroundings import view_of
from tipdamp.report.results import Results
from tipdamp.report.text import MM

LARGEST = 0.06  # drawn displacement over the size of what moves
CAPTION = (
    "Shapes on the surfaces of the meshes, recovered from the reduced model. Colour: "
    "displacement over its largest value; thin lines: sharp edges at rest. All bodies are "
    "magnified alike. Drag to turn."
)


def figures(results: Results) -> Iterator[ModeShapes]:
    """One picture with a choice of modes; none where the study has no meshes."""
    if not results.surfaces or results.model is None:
        return
    modes = tuple(_modes(results))
    if modes:
        seen = (
            view_of(results.whole, results.axis)
            if results.whole is not None
            else view((0.0, 0.0, 1.0), results.axis)
        )
        first = next((i for i, m in enumerate(modes) if "tracked" in m.label), 0)
        yield ModeShapes(
            "mode_shapes", "Mode shapes", CAPTION, results.surfaces, modes, first, *seen
        )


def _modes(results) -> Iterator[Mode]:
    """The modes in the order of the list, recovered on the surfaces."""
    dofs = {body: results.model.body == body for body in results.surfaces}
    for shapes in results.shapes:
        for kind, label, hz, q in zip(
            shapes.kind.tolist(), shapes.label.tolist(), shapes.hz.tolist(), shapes.q.T, strict=True
        ):
            moving = {body: s for body, s in results.surfaces.items() if q[dofs[body]].any()}
            moved = {body: s.displacement(q[dofs[body]]) for body, s in moving.items()}
            largest = max(
                (float(np.linalg.norm(u, axis=1).max()) for u in moved.values()), default=0.0
            )
            if largest > 0:
                size = np.ptp(np.concatenate([s.position for s in moving.values()]), axis=0)
                yield Mode(
                    kind,
                    label,
                    hz,
                    {b: u / np.float32(largest) for b, u in moved.items()},
                    LARGEST * MM * float(np.linalg.norm(size)),
                )
