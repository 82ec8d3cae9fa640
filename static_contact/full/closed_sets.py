"""Where Newton on the full model ends without an answer: sets of closed pairs by pivoting and proximal points."""

import numpy as np
import scipy.sparse as sp

from static_contact.complementarity import Normal, NotHeld, closed_pairs


class FullSets:
    """The problem of `newton._Newton` as sets of closed pairs, in the form that `closed_pairs` asks for: one factor
    for each set.

    B : (P, n) motion of the pairs, without the multipliers of hard ones; free : (P,) bool - pairs that may close
    """

    wrong = Normal.wrong          # the conditions are the same

    def __init__(self, newton, B, free):
        self.newton, self.free, self.k0, self.factored = newton, free, newton.k, 0
        B = sp.hstack([B, sp.csr_matrix((B.shape[0], newton.C.shape[1] - B.shape[1]))]).tocsr()
        low, high = newton.x.getOwnershipRange()
        self.B, self.B_own = B, B[:, low:high].tocsr()
        self.found = {}

    def solve(self):
        """k (C x - gap) of closed pairs and k (u - gap) of open ones as motions C x, and the residual."""
        gap = self.newton.gap
        u, N, closed, *_ = closed_pairs(self, None, gap)
        residual = self.found[u.tobytes()]
        return gap + np.divide(np.where(closed, N, self.k0 * (u - gap)), self.k0, out=np.zeros(len(gap)),
                               where=self.k0 > 0), residual

    def on_set(self, closed, _, gap, anchor=0.0, at=0.0):
        """u, N (P,) on a set, as `complementarity.Normal.on_set`."""
        newton, k = self.newton, self.k0
        anchors = anchor * (self.B_own.T @ sp.diags(k) @ self.B)
        newton.set_closed(newton.tangent, closed.astype(float), anchors)
        self.factored += 1
        right, x, F = newton.x.duplicate(), newton.x.duplicate(), newton.x.duplicate()
        right.getArray()[:] = newton.f + newton.C_own.T @ (closed * k * gap) + self.B_own.T @ (anchor * k * at)
        ksp = newton.direct(newton.PETSc.KSP().create(newton.comm))
        ksp.setOptionsPrefix("tipdamp_full_")
        ksp.setOperators(newton.tangent)
        try:
            ksp.solve(right, x)
            newton.tangent.mult(x, F)
            F.axpy(-1.0, right)
            held = F.norm() <= 1e-8 * right.norm()        # not so where it is no number
        except newton.PETSc.Error:
            held = False
        if not held:
            raise NotHeld(f"the {int(closed.sum())} pairs that stay closed do not hold the damper")
        u = newton.comm.tompi4py().allreduce(self.B_own @ x.getArray(readonly=True))
        N = np.where(closed, k * (newton.motion(x) - gap), 0.0)
        newton.residual(None, x, F)
        self.found[u.tobytes()] = F.norm() / newton.load
        for one in (ksp, right, x, F):
            one.destroy()
        return u, N
