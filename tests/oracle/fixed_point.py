"""The integer arithmetic of the servo interrupt, transcribed.

In: integers, or symbols of `fixed_point_proof.py`. Out: the same as firmware/src/interpolator/{motion,segment,braking}.rs
and firmware/src/stepgen/generator.rs. Every operation that the core does in a machine word goes through an `Exact`
(or the proof's counterpart), which knows the range of the word: with integers it raises `OutOfRange` where the core would
wrap or panic.

    python3 tests/oracle/fixed_point.py > tests/oracle/data/fixed_point.csv

writes the vectors that `tests/tests/fixed_point.rs` holds against the core, bit for bit.
"""

import random
import sys

T_FRAC, S_FRAC, PHASE_FRAC = 72, 54, 50
SLOTS = 560
UPPER_FRAC = PHASE_FRAC - 32
BRAKE_A_FRAC, BRAKE_J_FRAC, TICKS_BITS = 40, 44, 15

# The envelope: firmware/src/envelope.rs.
LENGTH_MIN, LENGTH_MAX = 1 << (S_FRAC - 34), (1 << (S_FRAC + 8)) - 1
FINE_MAX, SCALE_MAX = 1 << 30, 1 << 30
V_MAX, A_MAX, TICKS_MAX = 2 << T_FRAC, 1 << (T_FRAC - 3), 1 << 22
POSITION_MAX = ((1 << 31) - 1) << 32
STEPS_MAX, SPAN_MAX = SLOTS // 2, ((1 << 13) - 1) << PHASE_FRAC


class OutOfRange(Exception):
    """A result does not fit its word."""


def word_range(kind):
    """Least and largest value of `i32`, `u64`, .."""
    bits = int(kind[1:])
    return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if kind[0] == "i" else (0, (1 << bits) - 1)


def wrapped(x, kind):
    """`x` modulo the word, as `wrapping_add` and casts have it."""
    low, high = word_range(kind)
    return (x - low) % (high - low + 1) + low


class Exact:
    """Arithmetic of integers; shifts to the right round down, as Python's do."""

    def fit(self, kind, x):
        low, high = word_range(kind)
        if not low <= x <= high:
            raise OutOfRange(f"{x} in {kind}")
        return x

    def mul(self, kind, a, b):
        return self.fit(kind, a * b)

    def shr(self, x, bits):
        return x >> bits

    def div(self, x, by):
        return x // by


EXACT = Exact()


# interpolator/segment.rs

def high(m, a, b):
    """Upper word of a product."""
    return m.fit("i32", m.shr(m.mul("i64", a, b), 32))


def horner(m, fine, t):
    """The terms behind the slope, divided by t: `AxisCurve::at`."""
    total = fine[4]
    for c in reversed(fine[:4]):
        total = m.fit("i32", c + high(m, total, t))
    return total


def terms(m, slope, total, scale, place):
    """What is added to the base: three terms, each of 64 bits; their sum wraps as a phase does."""
    upper, low, fine = place
    return (
        m.mul("i64", slope, upper),
        high(m, slope, low),
        m.mul("i64", high(m, total, fine), scale),
    )


def at(base, slope, fine, scale, place):
    return wrapped(base + sum(terms(EXACT, slope, horner(EXACT, fine, place[2]), scale, place)), "i64")


def reciprocal(x):
    """2^127 / x for x with its top bit set, a little less."""
    r = ((1 << 32) - 1) // ((x >> 48) + 1) << 47
    for _ in range(3):
        missing = max(0, max(0, (1 << 63) - (r * x >> 64)) - 2)
        r = min((1 << 64) - 1, r + EXACT.fit("u64", 2 * (r * missing >> 64)))
    return r


def share(m, upper, lower, inverse_upper, inverse_lower):
    """The way left in 2^-63 of the length."""
    total = m.mul("u64", upper, inverse_upper)
    total = m.fit("u64", total + m.shr(m.mul("u64", upper, inverse_lower), 32))
    return m.fit("u64", total + m.shr(m.mul("u64", lower, inverse_upper), 32))


def place(left, length):
    """(high, low, fine) of the way `left` (T_FRAC) in a segment of `length` (S_FRAC)."""
    zeros = 64 - length.bit_length()
    aligned = EXACT.fit("u64", left << (32 - (T_FRAC - S_FRAC) + zeros) >> 32)
    inverse = reciprocal(length << zeros)
    s = share(EXACT, aligned >> 32, aligned & 0xFFFFFFFF, inverse >> 32, inverse & 0xFFFFFFFF)
    upper = EXACT.fit("i32", (s >> 32) - (1 << 30))
    return upper, wrapped((s & 0xFFFFFFFF) ^ (1 << 31), "i32"), EXACT.fit("i32", 2 * upper)


# interpolator/motion.rs

def step(m, left, v, a, jerk):
    """One tick: (left, v, a)."""
    a = m.fit("i96", a + jerk)
    v = m.fit("i96", v + a)
    return m.fit("i96", left - v), v, a


# interpolator/braking.rs

class Braking:
    """Deceleration tick by tick; limits `a` and `j` in words."""

    def __init__(self, a, j, v, d):
        a <<= T_FRAC - BRAKE_A_FRAC
        j = max(j << (T_FRAC - BRAKE_J_FRAC), 1, d >> TICKS_BITS)
        self.a = min(max(a, 1), EXACT.fit("i128", j << TICKS_BITS))
        self.j = j
        # The limit of the deceleration stays that of the first jerk.
        while not (d <= self.j or self.taken(d - self.j, self.ticks(d - self.j)) <= v):
            self.j = EXACT.fit("i128", self.j + (self.j >> 2) + 1)

    def ticks(self, d):
        """Whole ticks of the jerk, at most 2^16 - 1."""
        return min(max(d, 0) // self.j, (1 << 16) - 1)

    def triangle(self, n, m=EXACT):
        return m.mul("i128", self.j, m.shr(m.mul("u32", n, n + 1), 1))

    def taken(self, d, n, m=EXACT):
        return m.fit("i128", m.mul("i128", d, n + 1) - self.triangle(n, m))

    def next(self, v, d):
        low = d - self.j
        most = max(min(self.a, d + self.j), low)
        n = self.ticks(most)
        if self.taken(most, n) <= v:
            return min(most, v)
        while n > 0 and self.triangle(n) > v:
            n -= 1
        over = EXACT.fit("u64", EXACT.fit("u80", v - self.triangle(n)) // (n + 1))
        return min(max(self.j * n + over, low), v)


# stepgen/generator.rs

def phase(bits):
    return wrapped((bits + (1 << 31)) << (PHASE_FRAC - 32), "i64")


def pitch_of(m, mantissa, zeros):
    """Slots from edge to edge, Q16.16, for a way of `mantissa` 2^(16 - zeros) of the upper word."""
    return m.shr(m.mul("u32", SLOTS, m.div((1 << 32) - 1, mantissa)), 32 - UPPER_FRAC - zeros)


def first_of(m, first, pitch):
    return m.fit("u32", m.shr(m.mul("u64", first, pitch), 32))


def lone(m, part, mantissa):
    """The slot, Q16.16, of an edge that a `part` of `mantissa` lies before."""
    return m.fit("u32", m.div(m.mul("u32", part, SLOTS << 6), mantissa) * 1024)


def edge_place(first, span):
    whole = span >> 32
    if whole >> UPPER_FRAC:
        zeros = 32 - whole.bit_length()
        pitch = pitch_of(EXACT, (whole << zeros >> 16) + 1, zeros)
        return first_of(EXACT, first, pitch), pitch
    way = max(span >> (PHASE_FRAC - 32), 1)
    zeros = 32 - way.bit_length()
    return lone(EXACT, min(first, way) << zeros >> 16, (way << zeros >> 16) + 1), 0


def edges(before, after, was_negative, turn_slots):
    """(count, negative, first, pitch) of a tick from phase `before` to `after`, or None without a step."""
    steps = wrapped((after >> PHASE_FRAC) - (before >> PHASE_FRAC), "i14")
    if steps == 0:
        return None
    fraction = (before >> (PHASE_FRAC - 32)) & 0xFFFFFFFF
    span = abs(wrapped(after - before, "i64"))
    first, pitch = edge_place(fraction if steps < 0 else fraction ^ 0xFFFFFFFF, span)
    first, pitch = max(first - 1, 0), pitch if abs(steps) > 1 else 0
    if (steps < 0) != was_negative:
        left = ((SLOTS - turn_slots) << 16) // SLOTS
        first = EXACT.fit("u32", (turn_slots << 16) + (first * left >> 16))
        pitch = pitch * left >> 16
    return abs(steps), int(steps < 0), first, pitch


# Vectors.

def corner(rng, most, least=None):
    """A bound, a number next to one or next to zero, or any in between."""
    least = -most if least is None else least
    near = [most, most - 1, least, least + 1, 0, 1, -1]
    pick = rng.choice(near + [None] * 4)
    if pick is None:
        pick = rng.randint(least, most) >> rng.randrange(max(1, most.bit_length()))
    return min(max(pick, least), most)


def vectors(rng):
    """Rows of a name and integers, inputs before results."""
    for _ in range(1500):
        length = corner(rng, LENGTH_MAX, LENGTH_MIN)
        left = corner(rng, length << (T_FRAC - S_FRAC), 0)
        base, scale = corner(rng, (1 << 63) - 1), 1 << rng.randint(17, 30)
        slope = corner(rng, (1 << 31) - 1)
        fine = [corner(rng, FINE_MAX - 1) for _ in range(5)]
        where = place(left, length)
        yield ["at", length, left, base, slope, *fine, scale, *where, at(base, slope, fine, scale, where)]
    for _ in range(500):
        state = [corner(rng, LENGTH_MAX << 18), corner(rng, V_MAX), corner(rng, A_MAX)]
        jerk = corner(rng, (1 << 63) - 1)
        result = state
        for _ in range(3):
            result = step(EXACT, *result, jerk)
        yield ["motion", *state, jerk, *result]
    for _ in range(700):
        word = (1 << 32) - 1
        a, j = (corner(rng, word, 0) >> rng.randrange(20) for _ in range(2))
        # In the envelope, and as far as 96 bits go: braking has no bounds of its own.
        wide = (1 << 95) - 1
        v, d = rng.choice([(corner(rng, V_MAX, 0), corner(rng, A_MAX)), (corner(rng, wide, 0), corner(rng, wide, 0))])
        braking = Braking(a, j, v, d)
        results, speed = [], v
        for _ in range(4):
            d_next = braking.next(speed, results[-1] if results else d)
            results.append(d_next)
            speed -= d_next
        yield ["brake", a, j, v, d, *results]
    for _ in range(1500):
        at_first = corner(rng, POSITION_MAX)
        by = corner(rng, rng.choice([STEPS_MAX << 32, (1 << 45) - (1 << 32), 3 << 32]))
        to = min(max(at_first + by, -POSITION_MAX), POSITION_MAX)
        found = edges(phase(at_first), phase(to), False, 8) or (0, 0, 0, 0)
        yield ["edges", at_first, to, *found]


def committed():
    """The vectors of `data/fixed_point.csv`."""
    return vectors(random.Random(7))


def main():
    for row in committed():
        print(",".join(map(str, row)))


if __name__ == "__main__":
    sys.exit(main())
