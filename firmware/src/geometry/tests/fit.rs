//! The fitter against the curves it is given.

use super::support::*;
use crate::geometry::fit::{place, Curve, FitError, Fitter, Piece, Sample};
use crate::units::AXES;
use core::cell::Cell;
use proptest::prelude::*;

/// Sums of waves: smooth, with derivatives of all orders.
struct Waves {
    size: [f64; AXES],
    frequency: [f64; AXES],
    calls: Cell<u32>,
}

impl Curve for Waves {
    fn at(&self, t: f64) -> Option<Sample> {
        self.calls.set(self.calls.get() + 1);
        let (size, frequency) = (&self.size, &self.frequency);
        Some(Sample {
            offset: core::array::from_fn(|a| {
                size[a] * ((frequency[a] * t + 1.0).sin() - 1.0_f64.sin())
            }),
            slope: core::array::from_fn(|a| {
                size[a] * frequency[a] * (frequency[a] * t + 1.0).cos()
            }),
        })
    }
}

struct Of<F>(F);

impl<F: Fn(f64) -> Option<(f64, f64)>> Curve for Of<F> {
    fn at(&self, t: f64) -> Option<Sample> {
        let (value, slope) = (self.0)(t)?;
        Some(Sample {
            offset: [value; AXES],
            slope: [slope; AXES],
        })
    }
}

fn pieces(curve: &impl Curve, tolerance: f64) -> Result<Vec<Piece>, FitError> {
    let mut fitter = Fitter::new();
    let mut out = Vec::new();
    while let Some(piece) = fitter.next(curve, tolerance)? {
        out.push(piece);
        assert!(out.len() < 2_000_000);
    }
    Ok(out)
}

/// Largest distance at 64 parameters of each piece, its ends taken as the machine takes them: rounded to steps.
fn miss(curve: &impl Curve, pieces: &[Piece]) -> f64 {
    let config = config();
    let origin = steps(&config, &[123.456, -77.7, 0.001, 9.0, 1000.0]);
    let base = origin.map(|at| at.to_num::<f64>() / 1000.0);
    let mut worst = 0.0_f64;
    for piece in pieces {
        let path = crate::geometry::HermiteSegment {
            start: place(&config, &origin, &piece.start).unwrap(),
            end: place(&config, &origin, &piece.end).unwrap(),
            slope_start: piece.slope_start,
            slope_end: piece.slope_end,
        };
        for k in 0..=64 {
            let u = f64::from(k) / 64.0;
            let want = curve
                .at(piece.t0 + u * (piece.t1 - piece.t0))
                .unwrap()
                .offset;
            let at = evaluate(&path, u)[0];
            worst = worst.max(distance(&at, &core::array::from_fn(|a| base[a] + want[a])));
        }
    }
    worst
}

proptest! {
    #[test]
    fn pieces_stay_within_the_tolerance_and_join(
        size in prop::array::uniform5(-200.0..200.0_f64),
        frequency in prop::array::uniform5(0.0..60.0_f64),
        exponent in -4.0..-1.0_f64,
    ) {
        let tolerance = 10_f64.powf(exponent);
        let curve = Waves { size, frequency, calls: Cell::new(0) };
        let pieces = pieces(&curve, tolerance).unwrap();
        let calls = curve.calls.get();
        prop_assert!(calls < 20 * pieces.len() as u32 + 40, "{calls} for {}", pieces.len());
        prop_assert!(miss(&curve, &pieces) <= tolerance);
        prop_assert_eq!(pieces[0].t0, 0.0);
        for pair in pieces.windows(2) {
            prop_assert_eq!(pair[0].t1, pair[1].t0);
            prop_assert_eq!(pair[0].end, pair[1].start);
        }
        let ends: Vec<bool> = pieces.iter().map(|piece| piece.is_last).collect();
        prop_assert_eq!(ends.iter().position(|last| *last), Some(ends.len() - 1));
        prop_assert_eq!(pieces[pieces.len() - 1].t1, 1.0);
    }
}

#[test]
fn errors_that_hide_from_the_middle_are_seen() {
    // Remainders of a Hermite cubic over [0, 1] that vanish at 1/2, at 1/4 and 3/4, or at both.
    let shapes: [fn(f64) -> f64; 3] = [|v| v, |v| v * v - 1.0 / 16.0, |v| v * (v * v - 1.0 / 16.0)];
    for shape in shapes {
        let value = |t: f64| t + 1.0e3 * (t * (1.0 - t)).powi(2) * shape(t - 0.5);
        let slope = |t: f64| (value(t + 1e-6) - value(t - 1e-6)) / 2e-6;
        let curve = Of(|t| Some((value(t), slope(t))));
        let pieces = pieces(&curve, 1e-2).unwrap();
        assert!(pieces.len() > 1);
        assert!(miss(&curve, &pieces) <= 1e-2);
    }
}

#[test]
fn cubics_are_one_piece() {
    let curve = Of(|t: f64| Some((t * t * t - 3.0 * t, 3.0 * t * t - 3.0)));
    assert_eq!(pieces(&curve, 1e-4).unwrap().len(), 1);
}

#[test]
fn what_cannot_be_followed_is_refused_by_name() {
    let jump = Of(|t: f64| Some((if t > 0.3 { 1.0 } else { 0.0 }, 0.0)));
    assert_eq!(pieces(&jump, 1e-4), Err(FitError::Steep));
    let hole = Of(|t: f64| (t < 0.7).then_some((t, 1.0)));
    assert_eq!(pieces(&hole, 1e-4), Err(FitError::NotFinite));
    let pole = Of(|t: f64| Some((t / (0.75 - t), 0.75 / ((0.75 - t) * (0.75 - t)))));
    assert!(pieces(&pole, 1e-4).is_err());
    for tolerance in [0.0, -1.0, f64::NAN] {
        let wave = Of(|t: f64| Some((t.sin(), t.cos())));
        if tolerance != -1.0 {
            assert_eq!(pieces(&wave, tolerance), Err(FitError::Steep));
        }
    }
}

#[test]
fn places_are_rounded_to_a_step_once_and_refused_out_of_range() {
    use crate::geometry::GeometryErrorKind as K;
    let config = config();
    let origin = steps(&config, &[1.0, -2.0, 3.0, 4.0, 5.0]);
    assert_eq!(place(&config, &origin, &[0.0; AXES]), Ok(origin));
    let at = place(&config, &origin, &[0.1, -0.1, 1e-13, 1e5, -1e5]).unwrap();
    for (axis, want) in [1.1, -2.1, 3.0, 100_004.0, -99_995.0].iter().enumerate() {
        // 2^-32 step, or the resolution of f64 at this size.
        assert!((at[axis].to_num::<f64>() / 1000.0 - want).abs() < 3e-11);
    }
    let by = |value| {
        let mut by = [0.0; AXES];
        by[3] = value;
        place(&config, &origin, &by)
    };
    for far in [2.2e6, -2.2e6, 1e300, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(by(far), Err(K::OutOfRange { axis: 3 }));
    }
    assert_eq!(by(f64::NAN), Err(K::NotFinite));
}
