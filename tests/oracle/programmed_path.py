"""The path a program asks for, with derivatives along its length, cut where the machine has to stand.

In: a program, a machine file. Out: `Run`s, each a list of smooth `Piece`s between two standstills; a piece gives its
points' derivatives with respect to path length at any u in [0, 1], and the length between two u. Path length is counted
over the linear axes, and over the rotary axes in pieces where no linear axis moves.

What passing a joint between two pieces may cost (the planner's rules, docs/decisions/0006-corners.md):

    velocity      |dq'| v        <= corner_step, or what one tick hides: a_max dt (BRISK), j_max dt^2 (SOFT)
    acceleration  |dq''| v^2     <= j_max dt                                                          (SOFT)
                  |dq' a + dq'' v^2| <= j_max dt unless corner_step covers the velocity               (SOFT)

Under BRISK the acceleration may step. With dt one servo tick, these are the steps that sampled positions cannot tell from
motion within the limits. A joint whose velocity would stay below a hundredth of what its neighbours could reach between two
stops counts as a stop, and so does one between linear and rotary path length.
"""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import nc_program
import path_deviation

MACHINE = Path(__file__).resolve().parents[2] / "machines" / "mcv1210.toml"
GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(12)
STOP_SHARE = 0.01
# Spline pieces meet with rounding errors of this size relative to the derivatives themselves.
ROUNDING = 1e-7


@dataclass
class Machine:
    """Limits per axis, mm or degree and s."""

    names: str
    linear: np.ndarray
    v: np.ndarray
    a: np.ndarray
    j: np.ndarray
    corner: np.ndarray
    dt: float


def machine(path=MACHINE):
    """Machine of a TOML file."""
    with open(path, "rb") as text:
        table = tomllib.load(text)
    axes = table["axis"]
    column = lambda key: np.array([axis[key] for axis in axes], dtype=float)
    return Machine(
        "".join(axis["name"] for axis in axes),
        np.array([axis["kind"] == "linear" for axis in axes]),
        column("v_max"),
        column("a_max"),
        column("j_max"),
        column("corner_step"),
        1.0 / table["servo_hz"],
    )


class Cubic:
    """q(u) with coefficients [axis, power 3..0]."""

    def __init__(self, coefficients):
        self.c = np.asarray(coefficients, dtype=float)

    def derivatives(self, u):
        """q, dq/du, second and third; each [n, axis]."""
        u = np.asarray(u, dtype=float)[:, None]
        c3, c2, c1, c0 = self.c.T
        flat = 0.0 * u
        return ((c3 * u + c2) * u + c1) * u + c0, (3 * c3 * u + 2 * c2) * u + c1, 6 * c3 * u + 2 * c2, 6 * c3 + flat


class Arc:
    """Arc of the XY plane; further axes go along linearly with the angle."""

    def __init__(self, stretch):
        start, end = (np.array([float(v) for v in p]) for p in (stretch.start, stretch.points[0]))
        self.centre = start[:2] + [float(v) for v in stretch.centre]
        from_centre, to_end = start[:2] - self.centre, end[:2] - self.centre
        self.radius = np.hypot(*from_centre)
        if abs(np.hypot(*to_end) - self.radius) > 1e-9:
            raise ValueError(f"{stretch.line!r}: radii differ")
        self.first = np.arctan2(from_centre[1], from_centre[0])
        last = np.arctan2(to_end[1], to_end[0])
        sweep = (self.first - last if stretch.clockwise else last - self.first) % (2 * np.pi)
        if sweep < 1e-12:
            sweep = 2 * np.pi
        self.sweep = (sweep + 2 * np.pi * stretch.turns) * (-1.0 if stretch.clockwise else 1.0)
        self.start, self.delta = start, end - start

    def derivatives(self, u):
        """q, dq/du, second and third; each [n, axis]."""
        u = np.asarray(u, dtype=float)
        angle, w = self.first + self.sweep * u, self.sweep
        circle = self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        turned = self.radius * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
        rest = np.zeros((len(u), len(self.delta) - 2))
        line = self.start[2:] + u[:, None] * self.delta[2:]
        join = lambda xy, other: np.concatenate([xy, other], axis=1)
        return join(self.centre + circle, line), join(w * turned, rest + self.delta[2:]), join(-w * w * circle, rest), join(-(w**3) * turned, rest)


@dataclass
class Piece:
    """Smooth piece of path; `feed` per second along it, infinite for rapid motion."""

    shape: object
    counts: np.ndarray  # axes that make up the path length
    feed: float
    length: float = 0.0

    def speed(self, u):
        """ds/du at u [n]."""
        return np.sqrt((self.shape.derivatives(u)[1][:, self.counts] ** 2).sum(axis=1))

    def lengths(self, u):
        """Length between neighbouring u [n + 1]."""
        u = np.asarray(u, dtype=float)
        half, middle = 0.5 * np.diff(u), 0.5 * (u[1:] + u[:-1])
        return sum(w * half * self.speed(middle + half * x) for x, w in zip(GAUSS_X, GAUSS_W))

    def along(self, u):
        """q', q'', q''' with respect to path length at u [n]; each [n, axis]."""
        _, p1, p2, p3 = self.shape.derivatives(u)
        dot = lambda x, y: (x[:, self.counts] * y[:, self.counts]).sum(axis=1)[:, None]
        s1 = np.sqrt(dot(p1, p1))
        s2 = dot(p1, p2) / s1
        s3 = (dot(p2, p2) + dot(p1, p3) - s2 * s2) / s1
        first = p1 / s1
        second = (p2 - first * s2) / s1**2
        third = ((p3 - second * s1 * s2 - first * s3) / s1**2 - 2 * s2 * (p2 - first * s2) / s1**3) / s1
        return first, second, third


@dataclass
class Joint:
    """What happens between two pieces of a run."""

    v: float  # largest path velocity
    turn: np.ndarray  # dq' where path acceleration is turned under SOFT, else 0; per axis
    bend: np.ndarray  # dq'' likewise


@dataclass
class Run:
    """Path between two standstills."""

    pieces: list = field(default_factory=list)
    joints: list = field(default_factory=list)  # one fewer


def reach(m, piece):
    """Speed that a symmetric jerk-limited move over the whole piece reaches, rest to rest."""
    first = np.abs(piece.along(np.array([0.0, 0.5, 1.0]))[0]).max(axis=0)
    jerk = np.min(np.where(first > 1e-12, m.j / np.maximum(first, 1e-12), np.inf))
    return min(piece.feed, (0.25 * jerk * piece.length**2) ** (1.0 / 3.0))


def joint(m, before, after, soft):
    """Joint between two pieces, or None for a stop."""
    if np.any(before.counts != after.counts):
        return None
    end, start = before.along(np.array([1.0])), after.along(np.array([0.0]))
    step = [np.abs(b[0] - a[0]) for a, b in zip(end, start)]
    size = [np.maximum(np.abs(a[0]), np.abs(b[0])).max() for a, b in zip(end, start)]
    turn = np.where(step[0] > ROUNDING * size[0], step[0], 0.0)
    bend = np.where(step[1] > ROUNDING * size[1] + ROUNDING * size[0] / min(before.length, after.length), start[1][0] - end[1][0], 0.0)
    hidden = m.j * m.dt**2 if soft else m.a * m.dt
    with np.errstate(divide="ignore"):
        v = np.min(np.maximum(m.corner, hidden) / turn)
        if soft:
            v = min(v, np.min(np.sqrt(m.j * m.dt / np.abs(bend))))
    if soft and v < STOP_SHARE * min(reach(m, before), reach(m, after)):
        return None
    signed = np.where(turn > 0.0, start[0][0] - end[0][0], 0.0)
    covered = (turn > 0.0) & (m.corner > hidden)
    return Joint(float(v), np.where(covered, 0.0, signed), np.where(covered, 0.0, bend))


def pieces(m, program):
    """Pieces of the whole program, and for each whether the machine stands at its end."""
    stretches = nc_program.read(program, m.names)
    out, stops = [], []
    for n, stretch in enumerate(stretches):
        if stretch.kind == "arc":
            shapes = [Arc(stretch)]
        elif stretch.kind == "line":
            shapes = [Cubic(path_deviation.curve([stretch], m.linear)[0])]
        else:
            around = [s for s in stretches[max(0, n - 1) : n + 2] if s is stretch or s.kind == "line"]
            at = next(i for i, s in enumerate(around) if s is stretch)
            c = path_deviation.curve(around, m.linear)
            shapes = [Cubic(q) for q in c[at : len(c) - (len(around) - 1 - at)]]
        per_second = np.inf if stretch.feed is None else float(stretch.feed) / 60.0
        for shape in shapes:
            moved = np.abs(shape.derivatives(np.linspace(0.0, 1.0, 9))[1]).max(axis=0)
            counts = m.linear if moved[m.linear].max() > 1e-9 else ~m.linear
            piece = Piece(shape, counts, per_second)
            piece.length = float(piece.lengths(np.linspace(0.0, 1.0, 33)).sum())
            out.append(piece)
            stops.append(False)
        stops[-1] = stretch.exact
    return out, stops


def runs(m, program, soft):
    """The program from standstill to standstill."""
    out, previous = [Run()], None
    every, stops = pieces(m, program)
    for piece, stop in zip(every, stops):
        if previous is not None:
            between = joint(m, previous, piece, soft)
            if out[-1].pieces and between is not None:
                out[-1].joints.append(between)
            elif out[-1].pieces:
                out.append(Run())
        out[-1].pieces.append(piece)
        previous = piece
        if stop:
            out.append(Run())
            previous = None
    return [run for run in out if run.pieces]


@dataclass
class Grid:
    """A run cut into intervals. Derivatives at both ends of each interval, scaled by nothing: [n, axis]."""

    piece: np.ndarray  # index of the piece each interval is in
    u: np.ndarray  # [n, 2]
    ds: np.ndarray  # length of each
    left: tuple  # q', q'', q''' at its start
    right: tuple  # and at its end
    feed: np.ndarray  # of each
    node_v: np.ndarray  # [n + 1], from joints; zero at both ends
    joints: list  # (node, Joint)


def grid(run, edges):
    """Grid of `run` with `edges[p]` the u of all nodes of piece p, from 0 to 1."""
    ds, left, right, where, feed, u, joints, node_v = [], [], [], [], [], [], [], [0.0]
    for p, (piece, e) in enumerate(zip(run.pieces, edges)):
        ds.append(piece.lengths(e))
        d = piece.along(e)
        left.append([x[:-1] for x in d])
        right.append([x[1:] for x in d])
        n = len(e) - 1
        where += [p] * n
        feed += [piece.feed] * n
        u.append(np.stack([e[:-1], e[1:]], axis=1))
        node_v += [np.inf] * n
        if p < len(run.joints):
            node_v[-1] = run.joints[p].v
            joints.append((len(where), run.joints[p]))
    node_v[-1] = 0.0
    join = lambda parts: tuple(np.concatenate([part[i] for part in parts]) for i in range(3))
    return Grid(np.array(where), np.concatenate(u), np.concatenate(ds), join(left), join(right), np.array(feed), np.array(node_v), joints)


def refine(g, weight, total, pieces, least=2):
    """New edges: about `total` intervals with equal shares of `weight` (per interval), at least `least` per piece."""
    share = weight / weight.sum() * total
    edges = []
    for p in range(pieces):
        inside = np.flatnonzero(g.piece == p)
        count = max(least, int(np.ceil(share[inside].sum())))
        table = np.concatenate([[0.0], np.cumsum(share[inside])])
        at = np.concatenate([g.u[inside, 0], [1.0]])
        e = np.interp(np.linspace(0.0, table[-1], count + 1), table, at)
        e[0], e[-1] = 0.0, 1.0
        edges.append(e)
    return edges
