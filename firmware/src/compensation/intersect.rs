//! Where two pieces of the centre path cross.
//!
//! In: two [`Shape`]s with the ranges still in force. Out: the crossing that removes the least path from the end of the first
//! and the start of the second. The ranges are halved until both are bounded by narrow lenses about their chords
//! ([`Shape::span`]); lenses that do not meet are thrown away, the rest are polished by Newton's method.

use heapless::Vec;

use super::offset::{cross, norm, sub, Shape, Span};
use super::Meanwhile;

/// Pairs of spans looked at before what has been found must do: coincident curves would never end.
const BUDGET: u32 = 400;
/// Pending pairs: one per halving of either curve.
const DEPTH: usize = 48;
/// Spans shorter than this, mm, are points.
const POINT: f64 = 1.0e-7;
/// Lens narrow enough for Newton's method.
const NARROW: f64 = 0.15;

/// A crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Parameter on the first piece.
    pub u: f64,
    /// Parameter on the second.
    pub v: f64,
    /// Straight distance removed from both, mm.
    pub cost: f64,
    /// Sine of the angle from the first to the second direction.
    pub turn: f64,
}

/// A shape, its whole range and the part of it that is still in force.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    pub shape: &'a Shape,
    pub whole: [f64; 2],
    pub range: [f64; 2],
}

/// The crossing of the end of `a` with the start of `b` that removes the least path, or `None`.
///
/// Crossings whose sine is below `least_turn` do not count.
pub(super) fn intersect(
    a: &Part,
    b: &Part,
    least_turn: f64,
    meanwhile: Meanwhile,
) -> Option<Crossing> {
    let mut stack: Vec<[[f64; 2]; 2], DEPTH> = Vec::new();
    let _ = stack.push([a.range, b.range]);
    let mut best: Option<Crossing> = None;
    let mut left = BUDGET;
    while let Some([ra, rb]) = stack.pop() {
        meanwhile();
        left = left.saturating_sub(1);
        if left == 0 {
            break;
        }
        let (sa, sb) = (a.shape.span(ra, a.whole), b.shape.span(rb, b.whole));
        if !boxes_meet(&sa, &sb) {
            continue;
        }
        let tiny = sa.length < POINT && sb.length < POINT;
        if tiny || (sa.lean < NARROW && sb.lean < NARROW) {
            let sine = if tiny {
                1.0
            } else {
                cross(sa.chord, sb.chord).abs() / (sa.length * sb.length).max(f64::MIN_POSITIVE)
            };
            let start = if tiny {
                Some([ra[0], rb[0]])
            } else {
                chords_cross(&sa, &sb).map(|[s, t]| {
                    [
                        ra[0] + s.clamp(0.0, 1.0) * (ra[1] - ra[0]),
                        rb[0] + t.clamp(0.0, 1.0) * (rb[1] - rb[0]),
                    ]
                })
            };
            if let Some(found) = start.and_then(|at| polish(a, b, at)) {
                if found.turn.abs() >= least_turn && best.is_none_or(|best| found.cost < best.cost)
                {
                    best = Some(found);
                }
            }
            // Directions further apart than both lenses are wide: one crossing at most. Straight and parallel: none.
            if tiny || sine > 1.2 * (sa.lean + sb.lean) || sa.lean + sb.lean < 1.0e-9 {
                continue;
            }
        }
        // Halve the wider lens: the longer one, unless it is straight.
        let weight = |s: &Span, other: &Span| {
            if s.lean.is_finite() {
                s.bulge.max(1.0e-3 * s.length)
            } else {
                1.0e6 * s.length + other.length
            }
        };
        let first = weight(&sa, &sb) >= weight(&sb, &sa);
        let (halved, kept) = if first { (ra, rb) } else { (rb, ra) };
        let middle = 0.5 * (halved[0] + halved[1]);
        // Towards the joint first.
        let mut halves = [[halved[0], middle], [middle, halved[1]]];
        if !first {
            halves.swap(0, 1);
        }
        for half in halves {
            let _ = stack.push(if first { [half, kept] } else { [kept, half] });
        }
    }
    best
}

fn boxes_meet(a: &Span, b: &Span) -> bool {
    let by = a.bulge + b.bulge + POINT;
    (0..2).all(|k| {
        let low = a.at[0][k].min(a.at[1][k]) - b.at[0][k].max(b.at[1][k]);
        let high = b.at[0][k].min(b.at[1][k]) - a.at[0][k].max(a.at[1][k]);
        low <= by && high <= by
    })
}

/// Shares of the chords at which their lines cross.
fn chords_cross(a: &Span, b: &Span) -> Option<[f64; 2]> {
    let det = cross(a.chord, b.chord);
    if det.abs() <= 1.0e-9 * a.length * b.length {
        return None;
    }
    let by = sub(b.at[0], a.at[0]);
    Some([cross(by, b.chord) / det, cross(by, a.chord) / det])
}

/// Newton's method on O_a(u) = O_b(v) within the ranges in force.
fn polish(a: &Part, b: &Part, at: [f64; 2]) -> Option<Crossing> {
    let [mut u, mut v] = at;
    let mut rest = f64::INFINITY;
    for _ in 0..12 {
        let (pa, pb) = (a.shape.at(u, a.whole), b.shape.at(v, b.whole));
        let by = sub(pb.centre, pa.centre);
        rest = norm(by);
        let turn = cross(pa.tangent, pb.tangent);
        if rest < 1.0e-10 {
            break;
        }
        let (ja, jb) = (turn * pa.speed, turn * pb.speed);
        if ja.abs() < 1.0e-12 || jb.abs() < 1.0e-12 {
            break;
        }
        // A little beyond the ends, so that a crossing on the very end is found.
        let slack = |range: [f64; 2]| 1.0e-9 * (range[1] - range[0]);
        u = (u + cross(by, pb.tangent) / ja)
            .clamp(a.range[0] - slack(a.range), a.range[1] + slack(a.range));
        v = (v + cross(by, pa.tangent) / jb)
            .clamp(b.range[0] - slack(b.range), b.range[1] + slack(b.range));
    }
    if rest > 2.0 * POINT {
        return None;
    }
    u = u.clamp(a.range[0], a.range[1]);
    v = v.clamp(b.range[0], b.range[1]);
    let (pa, pb) = (a.shape.at(u, a.whole), b.shape.at(v, b.whole));
    let end = a.shape.at(a.range[1], a.whole).centre;
    let start = b.shape.at(b.range[0], b.whole).centre;
    Some(Crossing {
        u,
        v,
        cost: norm(sub(end, pa.centre)) + norm(sub(start, pb.centre)),
        turn: cross(pa.tangent, pb.tangent),
    })
}
