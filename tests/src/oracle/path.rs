//! From what a program does to the curves it asks for.

use super::read::{blocks_on, End, Item, Kind, Motion, Setup, Target};
use super::shape::{Arc, Rational, Shape};
use super::spline::{akima, b_spline, chord, cubic, norm, rational, Condition, Cubic, Point};

pub use super::shape::nearest;

/// One curve: the part of the path that one text line is responsible for.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Text line.
    pub line: u32,
    /// The curve.
    pub shape: Shape,
    /// Programmed end, 1e-6 mm or degree; `None` where the line programs a control point that is not on the path.
    pub end: Option<Target>,
    /// Programmed feed, mm/s; infinite for rapid motion; with `inverse` blocks per second.
    pub feed: f64,
    /// `G93`.
    pub inverse: bool,
    /// Comes to rest at its end because the program says so.
    pub stop: bool,
    /// Jerk-limited.
    pub soft: bool,
}

fn point(target: &Target) -> Point {
    target.map(|nano| nano as f64 * 1e-6)
}

/// One block of a spline.
struct Knot {
    line: u32,
    target: Target,
    interval: f64,
    weight: f64,
    feed: f64,
    inverse: bool,
    stop: bool,
    soft: bool,
}

/// A spline being collected.
struct Open {
    kind: Kind,
    ends: [End; 2],
    degree: usize,
    axes: [bool; 5],
    /// Direction of the path before it.
    before: Option<Point>,
    start: Target,
    points: Vec<Knot>,
}

fn condition(end: End, direction: Option<Point>, like: f64) -> Condition {
    match (end, direction) {
        (End::Auto, _) => Condition::Auto,
        (End::Tangent, Some(v)) => {
            let linear = norm(&[v[0], v[1], v[2], 0.0, 0.0]);
            // Millimetres and degrees of length have no common slope.
            if (linear > 0.0) != (like > 0.0) || norm(&v) == 0.0 {
                return Condition::Natural;
            }
            let length = if linear > 0.0 { linear } else { norm(&v) };
            Condition::Slope(v.map(|x| x / length))
        }
        _ => Condition::Natural,
    }
}

impl Open {
    /// Shape per block behind the early ones; `None` for a block whose interval is empty.
    fn shapes(&self, next: Option<Point>, early: usize) -> Vec<Option<Shape>> {
        let mut all = vec![point(&self.start)];
        all.extend(self.points.iter().map(|p| point(&p.target)));
        // Axes outside of the spline take no part in its chords.
        let masked = |p: &Point| core::array::from_fn(|i| if self.axes[i] { p[i] } else { 0.0 });
        let knots: Vec<Point> = all.iter().map(masked).collect();
        let linear = |k: usize| {
            chord(&knots[k], &knots[k + 1])
                * f64::from(u8::from(knots[k][..3] != knots[k + 1][..3]))
        };
        let begin = condition(self.ends[0], self.before.map(|v| masked(&v)), linear(0));
        let end = condition(
            self.ends[1],
            next.map(|v| masked(&v)),
            linear(knots.len() - 2),
        );
        let beside = |k: usize, mut cubic: Cubic| {
            let line = Cubic::line(&all[k], &all[k + 1]);
            for axis in (0..5).filter(|axis| !self.axes[*axis]) {
                for (to, from) in cubic.0.iter_mut().zip(line.0) {
                    to[axis] = from[axis];
                }
            }
            Some(Shape::Cubic(cubic))
        };
        match self.kind {
            Kind::A => (0..)
                .zip(akima(&knots, begin, end))
                .map(|(k, c)| beside(k, c))
                .collect(),
            Kind::C => (0..)
                .zip(cubic(&knots, begin, end))
                .map(|(k, c)| beside(k, c))
                .collect(),
            Kind::B => {
                let degree = early + 1;
                let spans: Vec<f64> = self.points[early..].iter().map(|p| p.interval).collect();
                let plain = self
                    .points
                    .iter()
                    .all(|p| p.weight == 1.0 && p.interval > 0.0);
                if plain {
                    let all = b_spline(degree, &all, &spans);
                    return all.into_iter().map(|c| Some(Shape::Cubic(c))).collect();
                }
                let mut at = 0.0;
                let mut knots = vec![0.0; degree + 1];
                for span in spans {
                    at += span;
                    knots.push(at);
                }
                knots.extend(vec![at; degree]);
                // The start of the spline is a control point, too: of the weight the blocks of the first span agree on
                // (so that equal weights cancel), else of weight 1.
                let first = self.points[0].weight;
                let agree = self.points[..degree].iter().all(|p| p.weight == first);
                let mut weights = vec![if agree { first } else { 1.0 }];
                weights.extend(self.points.iter().map(|p| p.weight));
                rational(degree, &all, &weights, &knots)
            }
        }
    }

    fn close(self, next: Option<Point>, out: &mut Vec<Curve>) {
        // Blocks before the first span have no curve of their own.
        let early = match self.kind {
            Kind::B => self.degree.min(self.points.len()) - 1,
            _ => 0,
        };
        let mut stop = self.points[..early].iter().any(|p| p.stop);
        let shapes = self.shapes(next, early);
        let count = shapes.len();
        for (k, (shape, p)) in shapes.into_iter().zip(&self.points[early..]).enumerate() {
            stop |= p.stop;
            let Some(shape) = shape else { continue };
            out.push(Curve {
                line: p.line,
                shape,
                end: (self.kind != Kind::B || k + 1 == count).then_some(p.target),
                feed: p.feed,
                inverse: p.inverse,
                stop: std::mem::take(&mut stop),
                soft: p.soft,
            });
        }
    }
}

/// The arc of a block.
fn arc(
    from: Point,
    to: Point,
    plane: [usize; 2],
    clockwise: bool,
    centre: &Result<[i64; 2], f64>,
    turns: u32,
) -> Arc {
    let [a, b] = plane;
    let (start, end) = ([from[a], from[b]], [to[a], to[b]]);
    let centre = match centre {
        Ok(nano) => nano.map(|n| n as f64 * 1e-6),
        Err(radius) => {
            let half = [(end[0] - start[0]) / 2.0, (end[1] - start[1]) / 2.0];
            let chord = half[0].hypot(half[1]);
            let height = (radius * radius - chord * chord).max(0.0).sqrt();
            // Left of the way for a short arc counter-clockwise.
            let left = if clockwise == (*radius < 0.0) {
                1.0
            } else {
                -1.0
            };
            let side = left * height / chord;
            [
                start[0] + half[0] - side * half[1],
                start[1] + half[1] + side * half[0],
            ]
        }
    };
    let polar = |p: [f64; 2]| {
        let d = [p[0] - centre[0], p[1] - centre[1]];
        (d[1].atan2(d[0]), d[0].hypot(d[1]))
    };
    let ((first, r0), (last, r1)) = (polar(start), polar(end));
    let whole = core::f64::consts::TAU;
    let turn = |angle: f64| match angle.rem_euclid(whole) {
        part if start == end || part == 0.0 => whole,
        part => part,
    };
    let sweep = if clockwise {
        -turn(first - last) - whole * f64::from(turns)
    } else {
        turn(last - first) + whole * f64::from(turns)
    };
    Arc {
        plane,
        centre,
        angle: first,
        sweep,
        radius: [r0, r1],
        from,
        to,
    }
}

/// The curve of a `POLY` block: coefficients of p made those of u = p / length.
///
/// The polynomials count from `origin`; an axis without one goes linearly, whatever the denominator.
fn polynomial(
    from: &Point,
    to: &Point,
    length: f64,
    axes: &[Option<[f64; 4]>; 5],
    under: &[f64; 5],
    origin: &Point,
) -> Rational {
    // Constant, value at the end, coefficients of p^2 to p^5: the linear one is what is left.
    let scaled = |start: f64, end: f64, higher: &[f64]| {
        let mut c = [start, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (k, h) in (2..).zip(higher) {
            c[k] = h * length.powi(k as i32);
        }
        c[1] = end - start - c[2..].iter().sum::<f64>();
        c
    };
    let below = scaled(1.0, under[0], &under[1..]);
    let over = |i: usize| {
        let (start, end) = (from[i] - origin[i], to[i] - origin[i]);
        let mut over = [0.0; 7];
        if let Some(higher) = &axes[i] {
            over[..6].copy_from_slice(&scaled(start, end * under[0], higher));
        } else {
            for (k, b) in below.iter().enumerate() {
                over[k] += b * start;
                over[k + 1] += b * (end - start);
            }
        }
        for (k, b) in over.iter_mut().zip(below) {
            *k += origin[i] * b;
        }
        over
    };
    Rational {
        over: core::array::from_fn(over),
        under: below,
    }
}

/// The curves `text` asks for on a plain machine, in order.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn path(text: &str) -> Vec<Curve> {
    path_on(&Setup::default(), text)
}

/// The curves `text` asks for on the machine `setup`, in order.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn path_on(setup: &Setup, text: &str) -> Vec<Curve> {
    let mut out: Vec<Curve> = Vec::new();
    let mut open: Option<Open> = None;
    let mut at: Target = [0; 5];
    for item in blocks_on(setup, text) {
        let Item::Block {
            line,
            motion,
            target,
            feed,
            inverse,
            stop,
            soft,
            anew,
        } = item
        else {
            if let Some(spline) = open.take() {
                spline.close(None, &mut out);
            }
            if let Some(last) = out.last_mut() {
                last.stop = true;
            }
            continue;
        };
        let (from, to) = (point(&at), point(&target));
        let push =
            |shapes: Vec<Shape>, feed: f64, open: &mut Option<Open>, out: &mut Vec<Curve>| {
                if let Some(spline) = open.take() {
                    spline.close(shapes.first().map(|s| s.slope(0.0)), out);
                }
                let count = shapes.len();
                out.extend((1..).zip(shapes).map(|(k, shape)| Curve {
                    line,
                    shape,
                    end: (k == count).then_some(target),
                    feed,
                    inverse,
                    stop: stop && k == count,
                    soft,
                }));
            };
        match motion {
            Motion::Rapid | Motion::Linear => {
                if at == target {
                    continue;
                }
                let feed = if motion == Motion::Rapid {
                    f64::INFINITY
                } else {
                    feed
                };
                push(
                    vec![Shape::Cubic(Cubic::line(&from, &to))],
                    feed,
                    &mut open,
                    &mut out,
                );
            }
            Motion::Cubic(b) => {
                // P = end + b3 v^3 + b2 v^2 + b1 v with v = 1 - u.
                let shape = Cubic([
                    core::array::from_fn(|i| to[i] + b[i][0] + b[i][1] + b[i][2]),
                    core::array::from_fn(|i| -3.0 * b[i][0] - 2.0 * b[i][1] - b[i][2]),
                    core::array::from_fn(|i| 3.0 * b[i][0] + b[i][1]),
                    core::array::from_fn(|i| -b[i][0]),
                ]);
                push(vec![Shape::Cubic(shape)], feed, &mut open, &mut out);
            }
            Motion::Arc {
                plane,
                clockwise,
                centre,
                turns,
            } => {
                let shape = Shape::Arc(arc(from, to, plane, clockwise, &centre, turns));
                push(vec![shape], feed, &mut open, &mut out);
            }
            Motion::Polynomial {
                length,
                axes,
                under,
                origin,
            } => {
                let origin = point(&origin);
                let shape = polynomial(&from, &to, length, &axes, &under, &origin);
                let shape = Shape::Rational(shape);
                push(vec![shape], feed, &mut open, &mut out);
            }
            Motion::Nurbs {
                order,
                points,
                weights,
                knots,
            } => {
                let points: Vec<Point> = points.iter().map(point).collect();
                let shapes = rational(order - 1, &points, &weights, &knots);
                push(
                    shapes.into_iter().flatten().collect(),
                    feed,
                    &mut open,
                    &mut out,
                );
            }
            Motion::Spline {
                kind,
                ends,
                degree,
                interval,
                weight,
                axes,
            } => {
                let next = Knot {
                    line,
                    target,
                    interval,
                    weight,
                    feed,
                    inverse,
                    stop,
                    soft,
                };
                match &mut open {
                    Some(spline) if spline.kind == kind && !anew => {
                        spline.ends[1] = ends[1];
                        spline.points.push(next);
                    }
                    _ => {
                        // Only the polygon of a B-spline is known to be tangent to it.
                        let direction =
                            (kind == Kind::B).then(|| core::array::from_fn(|i| to[i] - from[i]));
                        if let Some(spline) = open.take() {
                            spline.close(direction, &mut out);
                        }
                        open = Some(Open {
                            kind,
                            ends,
                            degree,
                            axes,
                            before: out.last().map(|curve| curve.shape.slope(1.0)),
                            start: at,
                            points: vec![next],
                        });
                    }
                }
            }
        }
        at = target;
    }
    if let Some(spline) = open.take() {
        spline.close(None, &mut out);
    }
    if let Some(last) = out.last_mut() {
        last.stop = true;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::spline::distance;
    use super::*;

    fn near(curve: &Curve, u: f64, p: Point) {
        let at = curve.shape.at(u);
        assert!(distance(&at, &p) < 1e-9, "{at:?} is not {p:?}");
    }

    #[test]
    fn arcs_turn_the_way_their_word_says() {
        let r = 10.0 * 0.5_f64.sqrt();
        for (text, x, y) in [
            ("G0 X10\nG3 F1 X0 Y10 I-10 J0", r, r),
            ("G0 X10\nG3 F1 X0 Y10 CR=10", r, r),
            ("G0 X10\nG2 F1 X0 Y10 CR=-10", -r, -r),
            ("G0 X10\nG2 F1 X0 Y10 I=AC(0) J=AC(0)", -r, -r),
            ("G0 X10\nG3 F1 X0 Y10 CR-10", 10.0 + r, 10.0 + r),
        ] {
            let curves = path(text);
            near(&curves[1], 0.5, [x, y, 0.0, 0.0, 0.0]);
            near(&curves[1], 1.0, [0.0, 10.0, 0.0, 0.0, 0.0]);
        }
        let helix = path("G0 X10\nG18 G2 F1 X10 Z0 Y6 I-10 TURN=2");
        near(&helix[1], 0.5, [-10.0, 3.0, 0.0, 0.0, 0.0]);
        // From Z to X is counter-clockwise in ZX: a twelfth of three turns clockwise leads from X to Z.
        near(&helix[1], 1.0 / 12.0, [0.0, 0.5, 10.0, 0.0, 0.0]);
    }

    #[test]
    fn a_quarter_circle_is_a_rational_quadratic_and_a_rational_polynomial() {
        let w = 0.5_f64.sqrt();
        let spline = path(&format!(
            "G0 X10\nBSPLINE SD=2 F1 X10 Y10 PW={w:.16}\nX0 Y10"
        ));
        // (1 - p^2, 2 p) / (1 + p^2) on p in 0..1, times 10: the end (0, 10), denominator 2 at the end.
        let poly = path("G0 X10\nPOLY F1 PO[X]=(0,-10) PO[Y]=(10,0) PO[]=(2,1)");
        for curve in [&spline[1], &poly[1]] {
            for k in 0..=8 {
                let p = curve.shape.at(f64::from(k) / 8.0);
                assert!((p[0].hypot(p[1]) - 10.0).abs() < 1e-9, "{p:?}");
            }
        }
    }

    #[test]
    fn equal_weights_cancel_and_a_fanuc_curve_is_the_same_b_spline() {
        let plain = path("BSPLINE F1 X1 Y2 PL=2\nX4 Y3 PL=0.5\nX5 Y1 PL=1\nX9 Y-1 PL=3");
        let equal = path(
            "BSPLINE F1 X1 Y2 PL=2 PW=1\nX4 Y3 PL=0.5 PW=1\nX5 Y1 PL=1 PW=1.0000001\nX9 Y-1 PL=3",
        );
        let setup = Setup {
            language: super::super::read::Language::Fanuc,
            ..Setup::default()
        };
        let fanuc = path_on(
            &setup,
            "G06.2 P4 K0 X0 Y0 F1\nK0 X1 Y2\nK0 X4 Y3\nK0 X5 Y1\nK1 X9 Y-1\nK4\nK4\nK4\nK4\nG01",
        );
        assert_eq!((plain.len(), equal.len(), fanuc.len()), (2, 2, 2));
        for k in 0..2 {
            for step in 0..=8 {
                let u = f64::from(step) / 8.0;
                let p = plain[k].shape.at(u);
                assert!(distance(&p, &equal[k].shape.at(u)) < 1e-5);
                assert!(distance(&p, &fanuc[k].shape.at(u)) < 1e-9);
            }
        }
    }
}
