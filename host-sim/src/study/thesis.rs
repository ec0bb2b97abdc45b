//! What the thesis printed of its 24 finishing runs (Tables 3.13.1, 3.14.1 and 3.14.2).
//!
//! Constants only; everything the study finds is compared with these.

use super::knots::Distribution;
use super::programs::Method;

/// Largest mean error a method may have to be called suitable (section 3.14), mm.
pub const LIMIT_MM: f64 = 0.08;
/// What microscope and clamping add to every printed mean error, mm. Section 3.12.5 names the causes and no number; the
/// difference between printed and computed errors is about this much.
pub const FLOOR_MM: f64 = 0.035;
/// Printed sizes of two finishing sub-programs (section 3.14), kB: linear 357 knots, C-spline 177 knots.
pub const SIZES_KB: [(Method, u32, f64); 2] = [(Method::Linear, 357, 40.6), (Method::C, 177, 20.0)];

/// A word of the tables "suitability".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// `OK`.
    Ok,
    /// `NOT`.
    Not,
}

impl Verdict {
    /// The printed word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "OK",
            Self::Not => "NOT",
        }
    }

    /// Verdict on a mean error of `mm`, measuring included.
    #[must_use]
    pub fn of(mm: f64) -> Self {
        if mm < LIMIT_MM {
            Self::Ok
        } else {
            Self::Not
        }
    }
}

/// Smallest real feed as it was noted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// Nothing is printed.
    Blank,
    /// The display did not stand still ("oscilations").
    Oscillates,
    /// mm/min.
    Value(f64),
}

/// One of the 24 rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    /// Mean absolute error over the eleven control points, mm.
    pub mae_mm: f64,
    /// Suitability.
    pub verdict: Verdict,
    /// Machining time of the finishing program, s.
    pub time_s: f64,
    /// Smallest real feed.
    pub feed: Feed,
}

/// The row of `method` on `knots` knots per turn; `None` for a set that was not milled.
#[must_use]
pub fn printed(method: Method, distribution: Distribution, knots: u32) -> Option<Printed> {
    use Feed::{Blank, Oscillates, Value};
    use Verdict::{Not, Ok};
    // A, B, C, linear: the order of Tables 3.14.
    let rows: [(f64, Verdict, f64, Feed); 4] = match (distribution, knots) {
        (Distribution::Polar, 360) => [
            (0.050, Ok, 22.34, Blank),
            (0.099, Not, 26.04, Blank),
            (0.049, Ok, 28.28, Blank),
            (0.054, Ok, 27.17, Blank),
        ],
        (Distribution::Polar, 72) => [
            (0.041, Ok, 21.2, Blank),
            (0.234, Not, 19.47, Blank),
            (0.035, Ok, 20.65, Blank),
            (0.088, Not, 37.0, Oscillates),
        ],
        (Distribution::Polar, 24) => [
            (0.676, Not, 18.27, Oscillates),
            (1.241, Not, 15.8, Blank),
            (0.382, Not, 17.93, Blank),
            (0.665, Not, 20.28, Value(650.0)),
        ],
        (Distribution::Equidistant, 357) => [
            (0.057, Ok, 20.0, Value(1000.0)),
            (0.047, Ok, 23.32, Value(800.0)),
            (0.059, Ok, 20.59, Value(1000.0)),
            (0.033, Ok, 30.42, Value(650.0)),
        ],
        (Distribution::Equidistant, 177) => [
            (0.025, Ok, 23.76, Value(900.0)),
            (0.055, Ok, 20.31, Value(1200.0)),
            (0.046, Ok, 20.6, Value(1300.0)),
            (0.040, Ok, 32.45, Value(500.0)),
        ],
        (Distribution::Equidistant, 57) => [
            (0.050, Ok, 22.41, Value(60.0)),
            (0.330, Not, 18.97, Value(1250.0)),
            (0.070, Ok, 19.97, Value(1100.0)),
            (0.114, Not, 35.29, Value(200.0)),
        ],
        _ => return None,
    };
    let index = match method {
        Method::A => 0,
        Method::B => 1,
        Method::C => 2,
        Method::Linear => 3,
    };
    let (mae_mm, verdict, time_s, feed) = rows[index];
    Some(Printed {
        mae_mm,
        verdict,
        time_s,
        feed,
    })
}

#[cfg(test)]
mod tests {
    use super::super::knots::FINISHING;
    use super::super::programs::METHODS;
    use super::*;

    #[test]
    fn the_printed_verdicts_follow_from_the_printed_errors() {
        for set in FINISHING {
            for method in METHODS {
                let row = printed(method, set.distribution, set.printed_count()).unwrap();
                assert_eq!(Verdict::of(row.mae_mm), row.verdict, "{method:?} {set:?}");
            }
        }
        assert_eq!(printed(Method::A, Distribution::Polar, 180), None);
    }
}
