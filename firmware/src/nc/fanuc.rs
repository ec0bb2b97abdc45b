//! Fanuc `G06.2`: the words of one NURBS block after another come in, points of a B-spline ([`Motion::Spline`]) go out.
//!
//! Block i of the curve carries the knot t_i and the control point Q_i with its weight R_i; P more blocks carry
//! nothing but a knot. The geometry stage counts differently: the position where the curve starts is its first control
//! point, and each [`Move`] brings one more and the length of the span it completes. So
//! - Q_0 moves nothing. It must be where the program stands ([`START_GAP`]), as Fanuc's own alarm for a wrong first
//!   control point has it; the position stays the one that was reached. It goes out as a point there with a span of zero,
//!   which tells the weight of the start;
//! - all weights are divided by R_0, which leaves a rational curve as it is;
//! - Q_i completes the span t_i..t_(i+1), for i from the degree P-1 on (before that there is none, and its interval
//!   is `None`). t_(i+1) stands in the next block, so one point is held back, with its own line number and feed.
//!
//! # How the interpreter drives it
//! For each line, in this order, without changing anything of its own before the last `Ok`:
//! 1. the line has a group 1 function other than `G06.2`, or it is the end of the program: [`Nurbs::end`];
//! 2. the line has `G06.2`, or [`Nurbs::active`] and it has `K`, `P`, `R` or an axis word: [`Nurbs::block`] with the
//!    target the axis words ask for (`G90`/`G91`, offsets, tool length; axes without a word where they are) and a
//!    template of the move (line number, feed, exact stop; its `motion` and `target` are not read). The line's
//!    target is then the program's position, unless it is the first of the curve.
//!
//! A [`Refusal`] leaves the curve as it was. It names the letter it is about: show the place of that word, or
//! the beginning of the line if it has none.

use super::command::{
    BoundaryCondition, Command, Cutter, FeedType, Motion, Move, Rounding, Side, SplineKind,
    SplineSpec,
};
use crate::catalogue::{dialect, nc, Message};
use crate::units::{Nano, AXES};

/// Largest distance per axis between the first control point and the position of the program, 1e-6 mm or degree.
pub const START_GAP: u64 = 1000;
/// Largest magnitude of a knot: differences of knots stay far inside `f32`.
const KNOT_MAX: f64 = 1.0e9;
/// Largest weight, and one over the smallest.
const WEIGHT_MAX: f64 = 1.0e6;
/// Order of a curve without `P`.
const ORDER: u8 = 4;

/// The words of one line of a NURBS curve. Numbers as printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NurbsWords {
    /// `G06.2` stands in this line: a new curve.
    pub begins: bool,
    /// `P`: order, 2 to 4.
    pub order: Option<f64>,
    /// `K`: knot.
    pub knot: Option<f64>,
    /// `R`: weight of the control point, 1 unless given.
    pub weight: Option<f64>,
    /// One bit per axis that has a word; 0 for a line that carries a knot only.
    pub axes: u8,
    /// The control point, absolute machine coordinates.
    pub target: [Nano; AXES],
}

/// Why a line was refused, and the address letter it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Number and text.
    pub message: &'static Message,
    /// Address whose word is shown; `G` stands for the line.
    pub letter: u8,
}

/// A control point whose span is not known yet. Smaller than the [`Move`] it becomes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    target: [Nano; AXES],
    block: u32,
    feed: f32,
    weight: f32,
    feed_type: FeedType,
    exact_stop: bool,
    soft: bool,
    rounding: Rounding,
}

/// What has come of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Curve {
    held: Option<Held>,
    knot: f64,
    /// R_0.
    weight: f64,
    /// Control points so far; counts no further than it matters.
    points: u8,
    /// Blocks with a knot only so far.
    tail: u8,
    /// Knots equal to the last one, it included.
    equal: u8,
    order: u8,
    axes: u8,
}

/// Collector of one NURBS curve after another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nurbs(Option<Curve>);

impl Nurbs {
    /// No curve.
    #[must_use]
    pub const fn new() -> Self {
        Self(None)
    }

    /// `G06.2` is in force: true from its block until [`Nurbs::end`].
    #[must_use]
    pub const fn active(&self) -> bool {
        self.0.is_some()
    }

    /// Forgets the curve, complete or not.
    pub fn reset(&mut self) {
        self.0 = None;
    }

    /// The curve ends here: another function of group 1 or the end of the program has come. Good without a curve, too.
    ///
    /// # Errors
    /// `NURBS_OPEN` (at `G`) if points or knots are missing; the curve is then still under way.
    pub fn end(&mut self) -> Result<(), Refusal> {
        if let Some(curve) = &self.0 {
            if curve.tail < curve.order {
                return Err(refuse(&dialect::NURBS_OPEN, b'G'));
            }
        }
        self.0 = None;
        Ok(())
    }

    /// Takes one line and hands out the control point that it completes, if any.
    ///
    /// `position`: where the program stands, absolute machine coordinates; counts at the first point.
    /// `template`: the move of this line but for motion and target.
    ///
    /// # Errors
    /// The catalogue rows `NURBS_*`: order, knots that are missing, fall, or are equal at the wrong places,
    /// too few points, a first point off `position`, a weight that is not positive, an axis the first point does not have,
    /// cutter compensation in force, a curve that is complete already or not yet; and `OUT_OF_RANGE` of the language.
    /// Nothing is emitted then.
    pub fn block(
        &mut self,
        words: &NurbsWords,
        position: &[Nano; AXES],
        template: &Move,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Refusal> {
        if template.cutter.side != Side::On {
            return Err(refuse(&dialect::NURBS_COMPENSATION, b'G'));
        }
        let curve = match &self.0 {
            Some(curve) if words.begins && curve.tail < curve.order => {
                return Err(refuse(&dialect::NURBS_OPEN, b'G'))
            }
            Some(curve) if !words.begins => {
                let curve = *curve;
                self.next(curve, words, template, emit)?
            }
            _ => {
                let curve = first(words, position)?;
                emit(Command::Move(Move {
                    target: *position,
                    motion: spline(curve.order - 1, Some(0.0), 1.0, true),
                    cutter: Cutter::OFF,
                    ..*template
                }));
                curve
            }
        };
        self.0 = Some(curve);
        Ok(())
    }

    /// The curve behind a line that is not its first.
    fn next(
        &self,
        mut curve: Curve,
        words: &NurbsWords,
        template: &Move,
        emit: &mut dyn FnMut(Command),
    ) -> Result<Curve, Refusal> {
        if curve.tail == curve.order {
            return Err(refuse(&dialect::NURBS_COMPLETE, b'G'));
        }
        if words.order.is_some() {
            return Err(refuse(&dialect::NURBS_ORDER, b'P'));
        }
        let knot = finite_knot(words)?;
        if knot < curve.knot {
            return Err(refuse(&dialect::NURBS_KNOT_ORDER, b'K'));
        }
        let span = knot - curve.knot;
        let equal = span == 0.0;
        curve.equal = if equal {
            curve.equal.saturating_add(1)
        } else {
            1
        };
        let weight = if words.axes == 0 {
            tail_knot(&curve, words, equal)?;
            curve.tail += 1;
            None
        } else {
            point_knot(&curve, words, equal)?;
            Some(point_weight(words)? / curve.weight)
        };
        if let Some(held) = curve.held.take() {
            let degree = curve.order - 1;
            // the held point has index points - 1
            let completes = curve.points > degree;
            emit(Command::Move(Move {
                block: held.block,
                motion: spline(degree, completes.then_some(span as f32), held.weight, false),
                target: held.target,
                feed: held.feed,
                feed_type: held.feed_type,
                exact_stop: held.exact_stop,
                soft: held.soft,
                rounding: held.rounding,
                cutter: Cutter::OFF,
            }));
        }
        if let Some(weight) = weight {
            curve.points = curve.points.saturating_add(1);
            curve.held = Some(Held {
                target: words.target,
                block: template.block,
                feed: template.feed,
                weight: weight as f32,
                feed_type: template.feed_type,
                exact_stop: template.exact_stop,
                soft: template.soft,
                rounding: template.rounding,
            });
        }
        curve.knot = knot;
        Ok(curve)
    }
}

#[cold]
fn refuse(message: &'static Message, letter: u8) -> Refusal {
    Refusal { message, letter }
}

/// A point of a curve.
fn spline(degree: u8, interval: Option<f32>, weight: f32, first: bool) -> Motion {
    Motion::Spline(SplineSpec {
        kind: SplineKind::BSpline,
        begin: BoundaryCondition::Natural,
        end: BoundaryCondition::Natural,
        degree,
        interval,
        weight,
        first,
        axes: u8::MAX,
        tool_point: None,
    })
}

fn finite_knot(words: &NurbsWords) -> Result<f64, Refusal> {
    match words.knot {
        Some(knot) if knot.abs() <= KNOT_MAX => Ok(knot),
        Some(_) => Err(refuse(&nc::OUT_OF_RANGE, b'K')),
        None => Err(refuse(&dialect::NURBS_KNOT_MISSING, b'G')),
    }
}

fn point_weight(words: &NurbsWords) -> Result<f64, Refusal> {
    let weight = words.weight.unwrap_or(1.0);
    if !(weight > 0.0) {
        Err(refuse(&dialect::NURBS_WEIGHT, b'R'))
    } else if !(WEIGHT_MAX.recip()..=WEIGHT_MAX).contains(&weight) {
        Err(refuse(&nc::OUT_OF_RANGE, b'R'))
    } else {
        Ok(weight)
    }
}

/// The line with `G06.2`.
fn first(words: &NurbsWords, position: &[Nano; AXES]) -> Result<Curve, Refusal> {
    let order = match words.order {
        None => ORDER,
        Some(2.0) => 2,
        Some(3.0) => 3,
        Some(4.0) => 4,
        Some(_) => return Err(refuse(&dialect::NURBS_ORDER, b'P')),
    };
    let knot = finite_knot(words)?;
    let weight = point_weight(words)?;
    if words.axes == 0 {
        return Err(refuse(&dialect::NURBS_AXIS, b'G'));
    }
    let off = |(target, position): (&Nano, &Nano)| target.abs_diff(*position) > START_GAP;
    if words.target.iter().zip(position).any(off) {
        return Err(refuse(&dialect::NURBS_START, b'G'));
    }
    Ok(Curve {
        held: None,
        knot,
        weight,
        points: 1,
        tail: 0,
        equal: 1,
        order,
        axes: words.axes,
    })
}

/// Knot and axes of a line with a control point; `equal` to the knot before, and counted in `curve.equal`.
fn point_knot(curve: &Curve, words: &NurbsWords, equal: bool) -> Result<(), Refusal> {
    if curve.tail > 0 {
        return Err(refuse(&dialect::NURBS_OPEN, b'G'));
    }
    if words.axes & !curve.axes != 0 {
        return Err(refuse(&dialect::NURBS_AXIS, b'G'));
    }
    if curve.points < curve.order {
        if !equal {
            return Err(refuse(&dialect::NURBS_KNOT_START, b'K'));
        }
    } else if curve.equal > curve.order {
        return Err(refuse(&dialect::NURBS_KNOT_START, b'K'));
    } else if curve.equal == curve.order {
        return Err(refuse(&dialect::NURBS_KNOT_MULTIPLE, b'K'));
    }
    Ok(())
}

/// Knot of a line without a control point.
fn tail_knot(curve: &Curve, words: &NurbsWords, equal: bool) -> Result<(), Refusal> {
    if words.weight.is_some() {
        return Err(refuse(&dialect::NURBS_WEIGHT, b'R'));
    }
    if curve.points < curve.order {
        return Err(refuse(&dialect::NURBS_POINTS, b'K'));
    }
    // the first one rises above the last point's knot, the others repeat it
    if equal == (curve.tail == 0) {
        return Err(refuse(&dialect::NURBS_KNOT_END, b'K'));
    }
    Ok(())
}
