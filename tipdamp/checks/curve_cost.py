"""What a curve of the forced response costs: evaluations of the equations along it with all that is
made of its points (peaks, estimated errors, named points), the multipliers of some of them or of
all, and its file."""

from collections.abc import Iterator
from dataclasses import dataclass

from tipdamp.checks.machine import Machine
from tipdamp.checks.sizes import Size
from tipdamp.hbm.balance.factors import flops


@dataclass(frozen=True)
class CurveCostSettings:
    """What a curve is taken to be: fitted to CPU times of [the two-blade rig, 18 pairs, H = 1 to
    19; the example of matrices, 4 pairs, H = 1 to 15; a wedge under platforms, 102 pairs on equal
    and 70 on unlike meshes, H = 1]."""

    points: float = 65.0  # of a curve on which all pairs stick: 63 to 73
    slipping: float = 40.0  # more where some slip: 74 to 180 in all ...
    points_a_pair: float = 0.5  # ... and for each of these
    evaluations: float = 2.5  # a point, with the steps that are taken back
    # of an evaluation beside the time of one on which all stick: a coefficient of the forces of a
    # pair that slips, and of one that stays
    acting: float = 0.012
    sticking: float = 0.0012
    # of a pair, components that Newton's system has rows for: two tangents, or some normals
    components: float = 2.0
    # evaluations of a law by file: a point's error takes twice the samples, and whether another
    # curve branches off there more of them than the point itself [creeping]
    by_file: float = 8.0
    # flops of the multipliers of the peaks over the cube of the pairs that act, whose events are
    # instants of the period [the wedge; 16 to 128 pairs of a beam]
    multipliers: float = 4e5
    # with multipliers everywhere and named points a curve on which all stick, or some slip, takes
    # so many times as long, and beside that those of so many peaks for each point
    everywhere: tuple[float, float] = (2.0, 3.0)
    a_point: float = 0.1
    # of a curve with enough harmonics: the points that are solved with more and more until these
    # are known
    probes: float = 0.3
    begin: float = 0.2  # s to load kernels and put the model together
    record: float = 0.3  # s to read a curve again and make its numbers
    drawn: int = 801  # frequencies of the linear response
    # bytes of a point for each pair beside its motion: shares of the cycle, work, forces
    pair_bytes: float = 80.0


SETTINGS = CurveCostSettings()


def curves_of(size: Size, acting: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """(H, pairs that slip) of each curve; harmonics = "auto" is content with the first where none
    slips."""
    each = len(size.curves) // len(acting)
    for i, slip in enumerate(acting):
        orders = size.curves[i * each : (i + 1) * each]
        for H in orders[:1] if size.auto and not slip else orders:
            yield H, slip


def seconds(size: Size, acting: tuple[int, ...], machine: Machine) -> float:
    """s of the curves of all levels, at which so many pairs slip or lift, one after the other."""
    found = SETTINGS.begin
    for H, slip in curves_of(size, acting):
        traced = _traced(size, H, slip, machine)
        probes = SETTINGS.probes * (size.auto and slip > 0 and H == size.curves[-1])
        found += traced * (1 + size.search + probes) + SETTINGS.record
        found += _multipliers(size, slip, traced, machine)
    return found


def disk(size: Size, acting: tuple[int, ...]) -> float:
    """Bytes of their files, and of that of the linear response."""
    found = 8.0 * SETTINGS.drawn * (1 + 2 * size.outputs)
    for H, slip in curves_of(size, acting):
        motion = 3 * size.kept_pairs * (2 * H + 1) + 2 * size.outputs * (H + 1)
        found += _points(slip) * (8 * motion + SETTINGS.pair_bytes * size.kept_pairs)
    return found


def _points(slip: float) -> float:
    return SETTINGS.points + (slip > 0) * SETTINGS.slipping + SETTINGS.points_a_pair * slip


def _traced(size: Size, H: int, slip: float, machine: Machine) -> float:
    """s of the evaluations: small arrays, forces, and a solution by factors or by iterations."""
    s, coefficients, pairs = SETTINGS, 2 * H + 1, size.kept_pairs
    forces = coefficients * (s.acting * slip + s.sticking * pairs)
    one = machine.evaluation * (1 + forces)
    one += min(flops(s.components * slip, H + 1)) / machine.flops * (slip > 0)
    by_file = s.by_file * size.cycles.get(H, 0.0)
    return _points(slip) * (s.evaluations * one + by_file)


def _multipliers(size: Size, slip: float, traced: float, machine: Machine) -> float:
    if size.stability == "none" or size.cycles:
        return 0.0
    peaks = SETTINGS.multipliers * slip**3 / machine.flops
    if size.stability == "peaks":
        return peaks
    further = SETTINGS.everywhere[slip > 0] - 1
    return traced * further + SETTINGS.a_point * _points(slip) * peaks
