//! The offset of one contour piece: where the centre of the tool is while it touches P(u).
//!
//! In: a cubic of the contour in its plane, or a corner. Out: centre, contour point and tangent at u, bounds of a range of
//! u, and where the offset stops being regular. With the left normal n and the signed radius d (left of the contour
//! positive) the centre is `O(u) = P(u) + d n(u)` and `O'(u) = P'(u) (1 - d k)`, k the signed curvature: the offset
//! runs along the contour's tangent wherever `d k < 1`.
//!
//! Pure `f64`: a micrometre at a metre leaves nothing for `f32` to lose.

/// Coordinates in the plane, mm.
pub(super) type Point = [f64; 2];

/// Least `1 - d k` of a piece that can be run: below it the tool does not fit into the curve.
const REGULAR: f64 = 1.0e-6;
/// Samples that look for a change of validity within one piece.
const SAMPLES: u32 = 16;
/// Breaks closer than this to an end, or to the one before, are the same.
const MERGE: f64 = 1.0e-5;

pub(super) fn add(a: Point, b: Point, k: f64) -> Point {
    [a[0] + k * b[0], a[1] + k * b[1]]
}
pub(super) fn sub(a: Point, b: Point) -> Point {
    add(a, b, -1.0)
}
pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
pub(super) fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
pub(super) fn norm(a: Point) -> f64 {
    libm::sqrt(dot(a, a))
}
/// Left normal.
pub(super) fn left(t: Point) -> Point {
    [-t[1], t[0]]
}
/// Unit vector; zero stays zero.
pub(super) fn unit(a: Point) -> Point {
    let length = norm(a);
    if length > 0.0 {
        [a[0] / length, a[1] / length]
    } else {
        a
    }
}

/// Largest coefficient of a derivative.
fn scale(c: &[[f64; 4]; 2]) -> f64 {
    c.iter()
        .flat_map(|c| &c[1..])
        .fold(0.0, |a: f64, b| a.max(b.abs()))
}

/// One piece of the path of the tool centre.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Offset of a cubic of the contour.
    Cubic {
        /// Power basis per plane axis.
        c: [[f64; 4]; 2],
        /// P(1) as programmed; the power basis meets it to rounding only.
        end: Point,
        /// Signed radius; 0 for a path that is not offset.
        d: f64,
    },
    /// Arc about an outer corner.
    Arc {
        /// The corner.
        centre: Point,
        /// Unit tangent at u = 0.
        tangent: Point,
        /// Angle the tangent turns by, radian, left positive; of the opposite sign to `d`.
        sweep: f64,
        /// Signed radius.
        d: f64,
    },
}

/// One point of a [`Shape`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Point of the contour.
    pub contour: Point,
    /// Unit tangent of contour and centre path.
    pub tangent: Point,
    /// Centre of the tool.
    pub centre: Point,
    /// d centre / du along the tangent, mm.
    pub speed: f64,
}

/// A range of u with bounds: the path lies within `bulge` of the chord between `at`, and its direction within the angle
/// whose tangent is `lean` of the chord's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub at: [Point; 2],
    pub chord: Point,
    pub length: f64,
    pub lean: f64,
    pub bulge: f64,
}

impl Shape {
    /// Straight line in the plane, not offset.
    pub fn line(from: Point, to: Point) -> Self {
        let by = sub(to, from);
        Self::Cubic {
            c: [[from[0], by[0], 0.0, 0.0], [from[1], by[1], 0.0, 0.0]],
            end: to,
            d: 0.0,
        }
    }

    /// Cubic in Hermite form.
    pub fn cubic(start: Point, end: Point, m0: Point, m1: Point, d: f64) -> Self {
        let axis = |a: usize| {
            let by = end[a] - start[a];
            [
                start[a],
                m0[a],
                3.0 * by - 2.0 * m0[a] - m1[a],
                m0[a] + m1[a] - 2.0 * by,
            ]
        };
        Self::Cubic {
            c: [axis(0), axis(1)],
            end,
            d,
        }
    }

    /// First and second derivative of the contour.
    fn derivatives(c: &[[f64; 4]; 2], u: f64) -> [Point; 2] {
        #[cfg(test)]
        super::tests::support::evaluated();
        [
            c.map(|[_, c1, c2, c3]| (3.0 * c3 * u + 2.0 * c2) * u + c1),
            c.map(|[_, _, c2, c3]| 6.0 * c3 * u + 2.0 * c2),
        ]
    }

    /// Direction of the contour at u, seen from the inside of the piece: where the derivative vanishes (a cusp, a doubled
    /// control point) the limit is taken a millionth inside `range`.
    fn direction(c: &[[f64; 4]; 2], u: f64, range: [f64; 2]) -> Point {
        let [first, _] = Self::derivatives(c, u);
        if norm(first) > 1.0e-6 * scale(c) {
            return unit(first);
        }
        let inside = if u - range[0] < range[1] - u {
            1.0e-6
        } else {
            -1.0e-6
        };
        unit(Self::derivatives(c, u + inside * (range[1] - range[0]))[0])
    }

    /// The point at u; `range` is the whole piece (it matters where the contour stands still).
    pub fn at(&self, u: f64, range: [f64; 2]) -> Sample {
        match self {
            Self::Cubic { c, end, d } => {
                let contour = if u == 1.0 {
                    *end
                } else {
                    c.map(|[c0, c1, c2, c3]| ((c3 * u + c2) * u + c1) * u + c0)
                };
                let tangent = Self::direction(c, u, range);
                let [first, second] = Self::derivatives(c, u);
                let square = dot(first, first);
                let bend = if *d != 0.0 && square > 0.0 {
                    d * cross(first, second) / square
                } else {
                    0.0
                };
                Sample {
                    contour,
                    tangent,
                    centre: add(contour, left(tangent), *d),
                    speed: norm(first) - bend,
                }
            }
            Self::Arc {
                centre,
                tangent,
                sweep,
                d,
            } => {
                let (sin, cos) = libm::sincos(sweep * u);
                let tangent = [
                    tangent[0] * cos - tangent[1] * sin,
                    tangent[0] * sin + tangent[1] * cos,
                ];
                Sample {
                    contour: *centre,
                    tangent,
                    centre: add(*centre, left(tangent), *d),
                    speed: -sweep * d,
                }
            }
        }
    }

    /// Bounds over `u`, a part of the piece `range` on which the offset is regular.
    ///
    /// All tangents of a cubic lie in the cone of the control vectors of its hodograph (a quadratic, hence its blossom), and
    /// a regular offset has the same tangents. A path whose tangents stay within an angle a of its chord stays within
    /// half the chord times tan a of it.
    pub fn span(&self, u: [f64; 2], range: [f64; 2]) -> Span {
        let at = u.map(|u| self.at(u, range).centre);
        let chord = sub(at[1], at[0]);
        let length = norm(chord);
        let lean = match self {
            Self::Cubic { c, .. } => {
                let blossom =
                    c.map(|[_, c1, c2, c3]| c1 + c2 * (u[0] + u[1]) + 3.0 * c3 * u[0] * u[1]);
                let mut lean: f64 = 0.0;
                for v in [
                    Self::derivatives(c, u[0])[0],
                    blossom,
                    Self::derivatives(c, u[1])[0],
                ] {
                    let (along, across) = (dot(v, chord), cross(v, chord).abs());
                    // A control vector of no length bounds nothing.
                    if along > 0.0 {
                        lean = lean.max(across / along);
                    } else if across > 0.0 || along < 0.0 {
                        lean = f64::INFINITY;
                    }
                }
                lean
            }
            Self::Arc { sweep, .. } => {
                let half = (sweep * (u[1] - u[0]) * 0.5).abs();
                if half < 1.0 {
                    libm::tan(half)
                } else {
                    f64::INFINITY
                }
            }
        };
        Span {
            at,
            chord,
            length,
            lean,
            bulge: if length > 0.0 {
                0.5 * length * lean
            } else {
                0.0
            },
        }
    }

    /// Box `[low x, low y, high x, high y]` around the range, mm, a micrometre wider than needed.
    pub fn bounds(&self, range: [f64; 2]) -> [f32; 4] {
        let mut out = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        let mut cover = |p: Point, by: f64| {
            for a in 0..2 {
                out[a] = out[a].min(p[a] - by);
                out[a + 2] = out[a + 2].max(p[a] + by);
            }
        };
        let step = 0.25 * (range[1] - range[0]);
        for k in 0..4 {
            let from = range[0] + step * f64::from(k);
            let span = self.span([from, from + step], range);
            if span.lean < 2.0 {
                cover(span.at[0], span.bulge);
                cover(span.at[1], span.bulge);
            } else {
                self.hull(&mut cover);
            }
        }
        // Single precision is good for a micrometre below 10 m.
        let slack = [-1.0e-3, -1.0e-3, 1.0e-3, 1.0e-3];
        core::array::from_fn(|k| (out[k] + slack[k]) as f32)
    }

    /// Covers the Bezier hull of the contour, a radius wider.
    fn hull(&self, cover: &mut impl FnMut(Point, f64)) {
        match self {
            Self::Cubic { c, end, d } => {
                cover(*end, d.abs());
                cover(c.map(|c| c[0]), d.abs());
                cover(c.map(|c| c[0] + c[1] / 3.0), d.abs());
                cover(c.map(|c| c[0] + (2.0 * c[1] + c[2]) / 3.0), d.abs());
            }
            Self::Arc { centre, d, .. } => cover(*centre, d.abs()),
        }
    }

    /// `1 - d k`, and `1 / (d k)` in terms of d: radius of curvature in the tool's direction (infinite on a line).
    pub fn room(&self, u: f64) -> f64 {
        match self {
            Self::Cubic { c, d, .. } => {
                let [first, second] = Self::derivatives(c, u);
                let speed = norm(first);
                1.0 - d * cross(first, second) / (speed * speed * speed).max(f64::MIN_POSITIVE)
            }
            Self::Arc { .. } => 1.0,
        }
    }

    /// Smallest radius of curvature the tool meets from the inside within `range`, mm.
    pub fn tightest(&self, range: [f64; 2]) -> f64 {
        let d = match self {
            Self::Cubic { d, .. } | Self::Arc { d, .. } => d.abs(),
        };
        let mut least: f64 = 1.0;
        for k in 0..=SAMPLES {
            let share = f64::from(k) / f64::from(SAMPLES);
            least = least.min(self.room(range[0] + share * (range[1] - range[0])));
        }
        d / (1.0 - least).max(1.0e-9)
    }

    /// The piece that begins at `from`: where it ends, and whether its offset is regular.
    ///
    /// It ends where the tool begins or ceases to fit, at a cusp, or at 1.
    pub fn piece(&self, from: f64) -> (f64, bool) {
        let Self::Cubic { c, .. } = self else {
            return (1.0, true);
        };
        if c.iter().all(|c| c[2] == 0.0 && c[3] == 0.0) {
            return (1.0, true);
        }
        let end = Self::cusp(c, from);
        let width = end - from;
        let node = |k: u32| from + width * f64::from(k) / f64::from(SAMPLES);
        let valid = |u: f64| self.room(u) > REGULAR;
        // The ends themselves may be where the last piece was broken, or cusps: look just inside.
        let first = from + 1.0e-3 * width / f64::from(SAMPLES);
        let state = valid(first);
        let mut before = [f64::INFINITY, self.room(first)];
        for k in 1..=SAMPLES {
            let u = if k == SAMPLES {
                end - 1.0e-3 * width / f64::from(SAMPLES)
            } else {
                node(k)
            };
            let room = self.room(u);
            let mut bad = u;
            if (room > REGULAR) == state
                && state
                && before[1] <= before[0]
                && before[1] <= room
                && before[1] < 0.5
            {
                // A tight spot between the samples.
                bad = self.least_room(node(k.saturating_sub(2)).max(first), u);
            }
            if valid(bad) != state {
                let (mut low, mut high) = (first.max(node(k.saturating_sub(2))), bad);
                if valid(low) != state {
                    low = first;
                }
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if valid(middle) == state {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                if low > from + MERGE && low < 1.0 - MERGE {
                    return (f64::from(low as f32), state);
                }
            }
            before = [before[1], room];
        }
        (end, state)
    }

    /// Where `room` is least between two bounds with one minimum: golden section.
    fn least_room(&self, low: f64, high: f64) -> f64 {
        const SHARE: f64 = 0.381_966_011_250_105;
        let (mut low, mut high) = (low, high);
        let mut at = [low + SHARE * (high - low), high - SHARE * (high - low)];
        let mut value = at.map(|u| self.room(u));
        for _ in 0..24 {
            if value[0] < value[1] {
                high = at[1];
                at = [low + SHARE * (high - low), at[0]];
                value = [self.room(at[0]), value[0]];
            } else {
                low = at[0];
                at = [at[1], high - SHARE * (high - low)];
                value = [value[1], self.room(at[1])];
            }
        }
        if value[0] < value[1] {
            at[0]
        } else {
            at[1]
        }
    }

    /// First point after `from` at which both derivatives vanish; 1 if there is none.
    fn cusp(c: &[[f64; 4]; 2], from: f64) -> f64 {
        let scale = scale(c);
        let mut out = 1.0;
        for [_, c1, c2, c3] in c {
            // 3 c3 u^2 + 2 c2 u + c1 = 0, stable pair.
            let root = c2 * c2 - 3.0 * c3 * c1;
            // A double root may come out slightly negative.
            let q = -(c2 + libm::sqrt(root.max(0.0)).copysign(*c2));
            for u in [q / (3.0 * c3), c1 / q] {
                if u > from + MERGE
                    && u < out - MERGE
                    && norm(Self::derivatives(c, u)[0]) < 1.0e-6 * scale
                {
                    out = f64::from(u as f32);
                }
            }
        }
        out
    }
}
