"""Where Newton on the full model ends without an answer: sets of closed pairs by pivoting and
proximal points."""

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from tipdamp.static_contact.normal.complementarity import (
    SETTINGS,
    SetSolution,
    no_equilibrium,
    solve_complementarity,
)

if TYPE_CHECKING:
    from tipdamp.static_contact.full.newton import ContactNewton


class FullSets:
    """The problem of `newton.ContactNewton` as a `complementarity.ContactProblem`: one factor for
    each set.

    B : (P, n) motion of the pairs, without the multipliers of hard ones; free : (P,) bool - pairs
    that may close"""

    rounding = SETTINGS.rounding

    def __init__(self, newton: "ContactNewton", B: sp.spmatrix, free: np.ndarray) -> None:
        self.newton, self.free, self.k0, self.factored = newton, free, newton.k, 0
        B = sp.hstack([B, sp.csr_matrix((B.shape[0], newton.C.shape[1] - B.shape[1]))]).tocsr()
        low, high = newton.x.getOwnershipRange()
        self.B, self.B_own = B, B[:, low:high].tocsr()
        self.found: dict[bytes, float] = {}

    def solve(self) -> tuple[np.ndarray, float]:
        """k (C x - gap) of closed pairs and k (u - gap) of open ones as motions C x, and the
        residual."""
        gap = self.newton.gap
        found = solve_complementarity(self, None, gap)
        push = np.where(found.closed, found.N, self.k0 * (found.u - gap))
        return (
            gap + np.divide(push, self.k0, out=np.zeros(len(gap)), where=self.k0 > 0),
            self.found[found.u.tobytes()],
        )

    def solve_set(
        self,
        closed: np.ndarray,
        u0: Any,
        gap: np.ndarray,
        anchor: float = 0.0,
        at: np.ndarray | float = 0.0,
    ) -> SetSolution:
        """As `complementarity.ContactProblem.solve_set`; the load stands in the equations, not in
        u0."""
        newton, k = self.newton, self.k0
        anchors = anchor * (self.B_own.T @ sp.diags(k) @ self.B)
        newton.set_closed(newton.tangent, closed.astype(float), anchors)
        self.factored += 1
        right, x, F = (newton.x.duplicate() for _ in range(3))
        right.getArray()[:] = (
            newton.f + newton.C_own.T @ (closed * k * gap) + self.B_own.T @ (anchor * k * at)
        )
        if not self._solved(right, x, F):
            raise no_equilibrium(closed)
        u = newton.comm.tompi4py().allreduce(self.B_own @ x.getArray(readonly=True))
        N = np.where(closed, k * (newton.motion(x) - gap), 0.0)
        newton.residual(None, x, F)
        self.found[u.tobytes()] = F.norm() / newton.load
        for one in (right, x, F):
            one.destroy()
        return SetSolution(u, N, np.zeros(0))

    def _solved(self, right: Any, x: Any, F: Any) -> bool:
        """Whether x now solves the tangent's equations; F is scratch."""
        newton = self.newton
        ksp = newton.direct(newton.PETSc.KSP().create(newton.comm))
        ksp.setOptionsPrefix("tipdamp_full_")
        ksp.setOperators(newton.tangent)
        try:
            ksp.solve(right, x)
            newton.tangent.mult(x, F)
            F.axpy(-1.0, right)
            # not so where it is no number
            return F.norm() <= newton.settings.set_residual * right.norm()
        except newton.PETSc.Error:
            return False
        finally:
            ksp.destroy()
