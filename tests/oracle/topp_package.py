"""The BRISK time once more, by the package toppra, on a grid of `programmed_path`.

In: a `Grid`. Out: the time by `topp.py` and by toppra. Between pieces the derivatives of a path may step; toppra takes one value
per grid point, so a piece ends and the next begins at two grid points a millionth of an interval apart.
"""

import logging

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from toppra.interpolator import AbstractGeometricPath

import topp

GAP = 1e-6


class Sampled(AbstractGeometricPath):
    """Derivatives known at grid points only; a last column is the path length itself, to carry feeds and joints."""

    def __init__(self, s, first, second):
        self.s, self.first, self.second = s, first, second

    def __call__(self, positions, order=0):
        at = np.clip(np.searchsorted(self.s, np.asarray(positions) - 1e-15), 0, len(self.s) - 1)
        if order == 0:
            out = np.zeros_like(self.first[at])
            out[..., -1] = positions
            return out
        return (self.first if order == 1 else self.second)[at]

    @property
    def dof(self):
        return self.first.shape[1]

    @property
    def path_interval(self):
        return np.array([self.s[0], self.s[-1]])


def compare(m, g):
    """(own time, time by toppra) of one run, s."""
    own = float(topp.times(g, topp.profile_constant_u(m, g)).sum())
    cap = topp.ceiling(m, g)
    starts = np.concatenate([[True], g.piece[1:] != g.piece[:-1]])
    s, first, second, v = [], [], [], []
    at = 0.0
    for k in range(len(g.ds)):
        if starts[k]:
            s.append(at + (GAP * g.ds[k] if k else 0.0))
            first.append(g.left[0][k])
            second.append(g.left[1][k])
            v.append(cap[k])
        at += g.ds[k]
        s.append(at)
        first.append(g.right[0][k])
        second.append(g.right[1][k])
        v.append(cap[k + 1])
    column = lambda rows, value: np.column_stack([rows, np.full(len(rows), value)])
    path = Sampled(np.array(s), column(first, 1.0), column(second, 0.0))
    top = np.sqrt(np.array(v))
    top = np.where(np.isfinite(top), top, 1e6)
    limit = np.concatenate([m.a, [1e12]])
    far = np.full(path.dof - 1, 1e9)

    def velocity(position):
        box = np.concatenate([far, [top[min(np.searchsorted(path.s, position - 1e-15), len(top) - 1)]]])
        return np.stack([-box, box], axis=1)

    logging.getLogger("toppra").setLevel(logging.ERROR)
    constraints = [
        toppra.constraint.JointVelocityConstraintVarying(velocity),
        toppra.constraint.JointAccelerationConstraint(
            np.stack([-limit, limit], axis=1), discretization_scheme=toppra.constraint.DiscretizationType.Interpolation
        ),
    ]
    instance = toppra.algorithm.TOPPRA(constraints, path, gridpoints=path.s, solver_wrapper="seidel")
    _, v, _ = instance.compute_parameterization(0.0, 0.0)
    if v is None or np.any(np.isnan(v)):
        return own, float("nan")
    with np.errstate(divide="ignore", invalid="ignore"):
        return own, float(np.nansum(2.0 * np.diff(path.s) / (v[:-1] + v[1:])))
