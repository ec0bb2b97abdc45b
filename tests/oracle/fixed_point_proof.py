"""Proof that no intermediate result of the servo interrupt leaves its word, anywhere in the envelope.

In: the formulas of `fixed_point.py`, the same functions that make the vectors, and the declared ranges of
firmware/src/envelope.rs. Out: a line per theorem; exit code 1 if one fails. Every claim is put to z3 as its negation, which
must have no model.

A product of two unknowns becomes a new unknown between its four corner planes (McCormick), which follow from the proven
bounds of its factors: so what z3 decides is linear. Where two products have to be compared, z3's nonlinear arithmetic does
it over the reals, which include the integers.
"""

import re
import sys
import time
from pathlib import Path

import z3

import fixed_point as core

ENVELOPE = Path(__file__).parents[2] / "firmware" / "src" / "envelope.rs"
VECTORS = Path(__file__).parent / "data" / "fixed_point.csv"


class Failed(Exception):
    """A claim that has a counterexample, or that z3 cannot decide."""


def prove(claim, *facts, timeout=20):
    solver = z3.Solver()
    solver.set("timeout", timeout * 1000)
    solver.add(*facts, z3.Not(claim))
    answer = solver.check()
    if answer != z3.unsat:
        raise Failed(f"{answer}: {claim}" + (f"\n  {solver.model()}" if answer == z3.sat else ""))


class Symbol:
    """An integer expression with bounds; sums and differences keep both."""

    def __init__(self, term, low, high):
        self.term, self.low, self.high = term, low, high

    @staticmethod
    def of(x):
        return x if isinstance(x, Symbol) else Symbol(z3.IntVal(x), x, x)

    def __add__(self, other):
        other = Symbol.of(other)
        return Symbol(self.term + other.term, self.low + other.low, self.high + other.high)

    def __sub__(self, other):
        other = Symbol.of(other)
        return Symbol(self.term - other.term, self.low - other.high, self.high - other.low)

    def __mul__(self, by):
        assert isinstance(by, int), "products of unknowns go through Proof.mul"
        low, high = sorted((self.low * by, self.high * by))
        return Symbol(self.term * by, low, high)

    __radd__, __rmul__ = __add__, __mul__


class Proof:
    """The counterpart of `fixed_point.Exact`: what it says fits, fits for all values of the symbols."""

    def __init__(self):
        self.facts, self.claims, self.count = [], 0, 0

    def any(self, low, high):
        """An unknown between two bounds."""
        self.count += 1
        x = z3.Int(f"x{self.count}")
        self.facts += [low <= x, x <= high]
        return Symbol(x, low, high)

    def word(self, kind):
        return self.any(*core.word_range(kind))

    def holds(self, claim):
        self.claims += 1
        prove(claim, *self.facts)

    def done(self):
        """How many claims were proved; the facts they rest on must not contradict each other."""
        solver = z3.Solver()
        solver.add(*self.facts)
        if solver.check() != z3.sat:
            raise Failed("the assumptions contradict each other")
        return self.claims

    def fit(self, kind, x):
        x = Symbol.of(x)
        low, high = core.word_range(kind)
        self.holds(z3.And(low <= x.term, x.term <= high))
        # The bounds are used by products later: z3 confirms them as well.
        self.holds(z3.And(x.low <= x.term, x.term <= x.high))
        return x

    def mul(self, kind, a, b):
        a, b = Symbol.of(a), Symbol.of(b)
        for x in (a, b):
            self.holds(z3.And(x.low <= x.term, x.term <= x.high))
        if a.low == a.high or b.low == b.high:
            constant, x = (a.low, b) if a.low == a.high else (b.low, a)
            return self.fit(kind, x * constant)
        ends = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
        p = self.any(min(ends), max(ends))
        self.facts += [
            p.term >= a.low * b.term + b.low * a.term - a.low * b.low,
            p.term >= a.high * b.term + b.high * a.term - a.high * b.high,
            p.term <= a.high * b.term + b.low * a.term - a.high * b.low,
            p.term <= a.low * b.term + b.high * a.term - a.low * b.high,
        ]
        return self.fit(kind, p)

    def shr(self, x, bits):
        x = Symbol.of(x)
        q = self.any(x.low >> bits, x.high >> bits)
        self.facts += [q.term * (1 << bits) <= x.term, x.term < (q.term + 1) * (1 << bits)]
        return q

    def div(self, x, by):
        """Rounded down, of and by positive numbers."""
        x = Symbol.of(x)
        q = self.any(x.low // by.high, x.high // by.low)
        # by.low q <= by q <= x
        self.facts += [q.term * by.low <= x.term, (q.term + 1) * by.high > x.term]
        return q


def corner_planes():
    """What `Proof.mul` assumes: a product lies between its corner planes."""
    a, b, low_a, high_a, low_b, high_b = z3.Reals("a b la ha lb hb")
    inside = [low_a <= a, a <= high_a, low_b <= b, b <= high_b]
    prove(a * b >= low_a * b + low_b * a - low_a * low_b, *inside)
    prove(a * b >= high_a * b + high_b * a - high_a * high_b, *inside)
    prove(a * b <= high_a * b + low_b * a - high_a * low_b, *inside)
    prove(a * b <= low_a * b + high_b * a - low_a * high_b, *inside)
    return 4


def quintic():
    """Horner's scheme in 32 bits, its product with the scale and the slope in 64."""
    m = Proof()
    fine = [m.any(1 - core.FINE_MAX, core.FINE_MAX - 1) for _ in range(5)]
    place = (m.any(-(1 << 30), (1 << 30) - 1), m.word("i32"), m.word("i32"))
    total = core.horner(m, fine, place[2])
    core.terms(m, m.word("i32"), total, m.any(1, core.SCALE_MAX), place)
    return m.done()


def alignment():
    """Whatever the length, shifting loses no bit of the way left, and what comes out is at most the aligned length."""
    claims = 0
    for zeros in range(64 - core.LENGTH_MAX.bit_length(), 64 - core.LENGTH_MIN.bit_length() + 1):
        m = Proof()
        length = m.any(1 << (63 - zeros), (1 << (64 - zeros)) - 1)
        left = m.any(0, length.high << 18)
        m.facts.append(left.term <= length.term * (1 << 18))
        aligned = left * (1 << (14 + zeros))
        m.holds(aligned.term < 1 << 96)
        m.holds(m.shr(aligned, 32).term <= length.term * (1 << zeros))
        # Word by word: shifts by 32 and more move whole words, and may not reach 64.
        m.holds(z3.BoolVal(14 + zeros < 64))
        claims += m.done()
    return claims


def reciprocal():
    """Newton's method from below stays below: r x < 2^127 after every step, and nothing overflows."""
    r, x, m = z3.Reals("r x m")
    top = z3.RealVal(2**63)
    start = [x >= 2**63, x < 2**64, r >= 0]
    # From the 16-bit quotient: h = floor(x / 2^48), r <= (2^32 - 1) / (h + 1) 2^47.
    h = z3.Real("h")
    prove(r * x < 2**127, *start, x < (h + 1) * 2**48, r * (h + 1) <= (2**32 - 1) * 2**47, h >= 0)
    # With y = r x / 2^64: missing <= 2^63 - y + 1 - 2 unless it is zero, and r' x / 2^64 <= y (1 + missing / 2^63).
    y = z3.Real("y")
    prove(y * (top + m) < top * top, y >= 0, y < top, m > 0, m <= top - y - 1)
    # 2 floor(r missing / 2^64) for r below 2^64 and missing up to 2^63.
    p = Proof()
    by = p.shr(p.mul("u128", p.word("u64"), p.any(0, 1 << 63)), 64)
    p.fit("u64", by * 2)
    # A sum that saturates would be 2^64 - 1, but r x < 2^127 and x >= 2^63 keep r at 2^64 or less.
    prove(r < 2**64, *start, r * x < 2**127)
    return 4 + p.done()


def share():
    """The share of the way left fits 64 bits whatever the words, and is below 2^63: t never passes the start."""
    m = Proof()
    words = [m.word("u32") for _ in range(4)]
    core.share(m, *words)
    # With the whole of a u64 each: aligned <= x and inverse x < 2^127 give aligned inverse < 2^127.
    a, x, r = z3.Reals("a x r")
    prove(a * r < 2**127, a <= x, r * x < 2**127, a >= 0, r >= 0)
    # aligned inverse = p 2^64 + (q + s) 2^32 + o; the share is what is left of it.
    p, q, s, o, q_up, s_up = z3.Ints("p q s o q_up s_up")
    products = [p >= 0, q >= 0, s >= 0, o >= 0, p * 2**64 + (q + s) * 2**32 + o < 2**127]
    floors = [q_up * 2**32 <= q, s_up * 2**32 <= s]
    prove(p + q_up + s_up < 2**63, *products, *floors)
    # So the upper word less 2^30 is between -2^30 and 2^30, and twice that fits.
    n = Proof()
    upper = n.shr(n.any(0, 2**63 - 1), 32) - 2**30
    n.fit("i31", upper)
    n.fit("i32", upper * 2)
    return m.done() + n.done() + 2


def motion():
    """A piece whose ends are in the envelope: acceleration, velocity and way fit 96 bits in every tick of it."""
    a, j, k, n = z3.Reals("a j k n")
    most = core.A_MAX
    ends = [-most <= a, a <= most, -most <= a + n * j, a + n * j <= most]
    for sign in (j >= 0, j <= 0):
        prove(z3.And(-most <= a + k * j, a + k * j <= most), *ends, sign, 0 <= k, k <= n)
    # Tick by tick: |v| <= V + k A goes on holding.
    v, a_next, i = z3.Ints("v a i")
    bound = core.V_MAX + i * most
    before = [i >= 0, -bound <= v, v <= bound, -most <= a_next, a_next <= most]
    prove(z3.And(v + a_next <= bound + most, v + a_next >= -bound - most), *before)
    m = Proof()
    speed = core.V_MAX + core.TICKS_MAX * most
    left = m.any(-speed, (core.LENGTH_MAX << 18) + speed)
    jerk = m.word("i64")
    core.step(m, left, m.any(-speed, speed), m.any(-most, most), jerk)
    return 3 + m.done()


def braking():
    """Whatever velocity and deceleration 96 bits hold, and whatever limits: 128 bits, and 32 where words divide."""
    most = (1 << 95) - 1
    m = Proof()
    # A jerk is raised from less than the deceleration, once; otherwise it is what the limits say, or the deceleration's share.
    raised = m.any(1, most)
    jerk = m.fit("i128", raised + m.shr(raised, 2) + 1)
    brake = core.Braking.__new__(core.Braking)
    brake.j = m.any(1, max(jerk.high, (1 << 32) << (core.T_FRAC - core.BRAKE_J_FRAC)))
    m.fit("i128", brake.j * (1 << core.TICKS_BITS))
    ticks, v = m.any(0, (1 << 16) - 1), m.any(0, most)
    d = m.any(-most, most)
    # `most` of Braking.next: at least d - J, at most d + J.
    brake.taken(d - brake.j, ticks, m)
    brake.taken(d + brake.j, ticks, m)
    m.fit("i128", v - brake.triangle(ticks, m))
    # A quotient is reached when D = `most`, of n = floor(D / J) ticks, is too much for v: taken = D (n + 1) - J n (n + 1) / 2.
    # It is a limit below 2^64 then, since for d - J there is room: jerks are raised until there is, and never fall. After
    # coming down to k ticks, J (k + 1) (k + 2) / 2 > v, or k = n.
    limit, jerk, n, k, speed = z3.Reals("D J n k v")
    area = jerk * n * (n + 1) / 2
    facts = [limit < 2**64, jerk > 0, n >= 0, jerk * n <= limit, speed >= 0]
    prove(speed - area < 2**64 * (n + 1), *facts, area >= 0, limit * (n + 1) - area > speed)
    lower = jerk * k * (k + 1) / 2
    prove(speed - lower < jerk * (k + 1), lower + jerk * (k + 1) > speed)
    prove(jerk * (k + 1) <= 2**64 * (k + 1), *facts, k >= 0, k + 1 <= n, jerk <= 2**64)
    prove(jerk <= limit, jerk * n <= limit, jerk > 0, n >= 1)
    # A digit with the rest before it is a word.
    by = m.any(1, 1 << 16)
    rest = m.any(0, (1 << 16) - 1)
    m.facts.append(rest.term < by.term)
    part = m.fit("u32", rest * (1 << 16) + m.word("u16"))
    # rest < by: so every digit of the quotient has 16 bits.
    r, b, digit = z3.Ints("r b digit")
    prove(r * 2**16 + digit < b * 2**16, 0 <= r, r < b, 0 <= digit, digit < 2**16)
    m.fit("i128", m.mul("i128", brake.j, ticks) + v)
    assert part.high == (1 << 32) - 1
    return m.done() + 5


def edges():
    """Steps of a tick: no word overflows, and the last edge lies inside the tick."""
    claims = 0
    for zeros in range(32 - core.UPPER_FRAC):
        m = Proof()
        mantissa = m.any((1 << 15) + 1, 1 << 16)
        m.fit("u32", core.first_of(m, m.word("u32"), core.pitch_of(m, mantissa, zeros)))
        # pitch W < SLOTS 2^34, where W = w 2^(16 - zeros), w the mantissa, is more than the way's upper word.
        q, w, pitch = z3.Reals("q w pitch")
        facts = [q >= 0, w > 0, q * w <= 2**32 - 1]
        fast = pitch * (1 << (14 - zeros)) <= core.SLOTS * q
        prove(pitch * w * 2 ** (16 - zeros) < core.SLOTS * 2**34, *facts, fast)
        claims += m.done() + 1
    # D, the way to the last edge (Q32 steps), is less than W 2^14: so is its time, D pitch / 2^32, than SLOTS 2^16.
    d, w, pitch = z3.Reals("d w pitch")
    inside = [d >= 0, pitch >= 0, w > 0, d <= w * 2**14, pitch * w < core.SLOTS * 2**34]
    prove(d * pitch < core.SLOTS * 2**16 * 2**32, *inside)
    m = Proof()
    mantissa = m.any((1 << 15) + 1, 1 << 16)
    part = m.any(0, (1 << 16) - 1)
    core.lone(m, part, mantissa)
    # A part smaller than its mantissa is a slot inside the tick.
    share, p, whole = z3.Ints("share p whole")
    prove(share < core.SLOTS << 6, share * whole <= p * (core.SLOTS << 6), p < whole, p >= 0, whole > 0)
    # After a turn: what is squeezed behind the slots kept free still ends inside the tick.
    for turn in range(core.SLOTS // 2 + 1):
        left = ((core.SLOTS - turn) << 16) // core.SLOTS
        last = (core.SLOTS << 16) - 1
        if (turn << 16) + (last * left >> 16) >= core.SLOTS << 16:
            raise Failed(f"turn of {turn} slots")
    return claims + m.done() + 2


def counts():
    """Whole steps of neighbouring phases: their difference has 14 bits, and the count of steps 32."""
    before, after = z3.Ints("before after")
    whole = 1 << core.PHASE_FRAC
    moved = after / whole - before / whole
    near = z3.And(after - before <= core.SPAN_MAX, before - after <= core.SPAN_MAX)
    prove(z3.And(moved >= -(1 << 13), moved < 1 << 13), near)
    position = z3.Int("position")
    count = (position + (1 << 31)) / (1 << 32)
    range_ = [-core.POSITION_MAX <= position, position <= core.POSITION_MAX]
    prove(z3.And(count >= -(1 << 31), count < 1 << 31), *range_)
    return 2


def envelope_is_declared():
    """The ranges assumed here are those of the core."""
    text = ENVELOPE.read_text()
    names = {"S_FRAC": core.S_FRAC, "T_FRAC": core.T_FRAC, "PHASE_FRAC": core.PHASE_FRAC, "SLOTS": core.SLOTS}
    pattern = r"pub const (\w+): \w+ =\s*([^;]+);"
    found = {name: eval(value.replace("/", "//"), {}, names) for name, value in re.findall(pattern, text)}
    for name in ("LENGTH_MIN", "LENGTH_MAX", "FINE_MAX", "SCALE_MAX", "V_MAX", "A_MAX", "TICKS_MAX", "POSITION_MAX",
                 "STEPS_MAX", "SPAN_MAX"):
        if found[name] != getattr(core, name):
            raise Failed(f"{name} is {found[name]} in the core, {getattr(core, name)} here")
    return 0


def vectors_are_committed():
    """What the core is held against are the results of these very formulas."""
    try:
        rows = [",".join(map(str, row)) for row in core.committed()]
    except core.OutOfRange as why:
        raise Failed(f"vectors: {why}") from why
    if VECTORS.read_text().splitlines() != rows:
        raise Failed(f"{VECTORS.name} is not what fixed_point.py writes")
    return 0


THEOREMS = (
    envelope_is_declared, vectors_are_committed, corner_planes, quintic, alignment, reciprocal, share, motion, braking,
    edges, counts,
)


def main():
    started = time.monotonic()
    failed = 0
    for theorem in THEOREMS:
        begun = time.monotonic()
        try:
            result = f"{theorem()} claims"
        except Failed as why:
            failed += 1
            result = f"FAILED\n  {why}"
        print(f"{theorem.__name__}: {result}, {time.monotonic() - begun:.1f} s")
    print(f"{len(THEOREMS) - failed} of {len(THEOREMS)} theorems in {time.monotonic() - started:.1f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
