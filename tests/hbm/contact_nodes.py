"""The references C1 and D1 with a light contact node between the body and its contact.

The node hangs on the body by a spring STIFFER times that of the contact, in every direction, and
the contact springs are raised so that both in series are those of the reference: without mass the
node changes nothing. With mass it chatters on re-contact.
"""

import numpy as np

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import Contacts

STIFFER = 3.0


def with_node(problem: ContactProblem, mass: float) -> ContactProblem:
    """`problem` with one pair, whose contact acts on a node of `mass` for each component that
    moves."""
    B = np.asarray(problem.B, dtype=float)
    moving = np.flatnonzero(np.abs(B).max(axis=1) > 0)
    r, m = len(problem.K), len(moving)
    k = STIFFER * problem.law.stuck_stiffness(problem.contacts).ravel()[moving]
    between = np.hstack([B[moving], -np.eye(m)])  # stretch of the node's springs
    grown = np.zeros((r + m, r + m))
    M, C, K = grown.copy(), grown.copy(), grown.copy()
    M[:r, :r], C[:r, :r], K[:r, :r] = problem.M, problem.C, problem.K
    M[r:, r:] = mass * np.eye(m)
    K += (between.T * k) @ between
    nodes = np.zeros((len(B), r + m))
    nodes[moving, r + np.arange(m)] = 1.0
    in_series = STIFFER / (STIFFER - 1)
    p = problem.contacts
    pairs = Contacts(in_series * p.kn, in_series * p.kt, p.mu, p.preload)
    static = None if problem.static is None else np.r_[problem.static, np.zeros(m)]
    return ContactProblem(M, C, K, nodes, problem.law, pairs, static, problem.preloaded)
