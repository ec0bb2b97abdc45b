//! The six knot sets of the thesis (section 2.2) and the knots of a whole finishing sub-program.
//!
//! In: a [`KnotSet`]. Out: knots in whole micrometres, as they are printed. Touches only [`super::contour`].

use std::f64::consts::TAU;

use super::contour;

/// Depth of the finished contour, micrometres.
const DEPTH: i64 = -6000;
/// First point of every main program, `X13.856 Y-8.000 Z0.500`: the contour at -30 degrees, half a millimetre
/// above the work. The height of the lead knots is proportional to their place between there and the work; the
/// thesis prints one of them, `X17.387 Y-4.659 Z0.250` at -15 degrees (Table 2.3.2.1.1).
const APPROACH_DEGREES: f64 = 30.0;
const APPROACH_HEIGHT: f64 = 500.0;

/// How the knots lie on the contour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Equal angles.
    Polar,
    /// Equal arcs.
    Equidistant,
}

impl Distribution {
    /// The word of the tables and of the JSON file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Polar => "polar",
            Self::Equidistant => "equidistant",
        }
    }
}

/// One of the knot sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnotSet {
    /// How the knots lie.
    pub distribution: Distribution,
    /// Degrees between knots (polar), or knots per quadrant counting both its ends (equidistant): the number in
    /// the names of the sub-programs.
    pub parameter: u32,
    /// Knots before the first and behind the last turn (Tables 2.2.3.1 and 2.2.3.2).
    pub leads: u32,
}

/// The sets that were milled, in the order of Tables 3.14.1 and 3.14.2.
pub const FINISHING: [KnotSet; 6] = [
    KnotSet::new(Distribution::Polar, 1, 10),
    KnotSet::new(Distribution::Polar, 5, 3),
    KnotSet::new(Distribution::Polar, 15, 2),
    KnotSet::new(Distribution::Equidistant, 90, 12),
    KnotSet::new(Distribution::Equidistant, 45, 6),
    KnotSet::new(Distribution::Equidistant, 15, 2),
];

/// A knot, `[x, y, z]` in micrometres.
pub type Knot = [i64; 3];

impl KnotSet {
    const fn new(distribution: Distribution, parameter: u32, leads: u32) -> Self {
        Self {
            distribution,
            parameter,
            leads,
        }
    }

    /// Different knots on one turn.
    #[must_use]
    pub fn distinct(&self) -> u32 {
        match self.distribution {
            Distribution::Polar => 360 / self.parameter,
            Distribution::Equidistant => 4 * (self.parameter - 1),
        }
    }

    /// Knots per turn as the thesis counts them: equidistant ones with the closing knot.
    #[must_use]
    pub fn printed_count(&self) -> u32 {
        match self.distribution {
            Distribution::Polar => self.distinct(),
            Distribution::Equidistant => self.distinct() + 1,
        }
    }

    /// One turn counter-clockwise from X22 Y0 without the closing knot, mm, not rounded.
    #[must_use]
    pub fn turn(&self) -> Vec<[f64; 2]> {
        match self.distribution {
            Distribution::Polar => (0..self.distinct())
                .map(|k| contour::point(f64::from(k * self.parameter).to_radians()))
                .collect(),
            Distribution::Equidistant => {
                // One quadrant is solved; the others are its images, as in the thesis (section 2.2.2).
                let quadrant: Vec<[f64; 2]> = contour::equal_arcs(self.parameter - 1)
                    .into_iter()
                    .map(contour::point)
                    .collect();
                let end = quadrant.len() - 1;
                let rotated = |[x, y]: [f64; 2], quarter: usize| match quarter {
                    0 => [x, y],
                    1 => [-y, x],
                    2 => [-x, -y],
                    _ => [y, -x],
                };
                (0..4)
                    .flat_map(|quarter| quadrant[..end].iter().map(move |&p| rotated(p, quarter)))
                    .collect()
            }
        }
    }

    /// Knots of the finishing sub-program: lead-in, a turn that falls from 0 to -6 mm, one at -6 mm, one that
    /// rises to 0, the closing knot, lead-out (section 2.2.3.2).
    #[must_use]
    pub fn finishing(&self) -> Vec<Knot> {
        let turn = self.turn();
        let (n, leads) = (i64::from(self.distinct()), i64::from(self.leads));
        let rise = self.lead_rise();
        let falling = |k: i64| DEPTH as f64 * k as f64 / n as f64;
        (-leads..=3 * n + leads)
            .map(|k| {
                let z = match k {
                    k if k < 0 => -k as f64 * rise,
                    k if k <= n => falling(k),
                    k if k <= 2 * n => DEPTH as f64,
                    k if k <= 3 * n => falling(3 * n - k),
                    k => (k - 3 * n) as f64 * rise,
                };
                let [x, y] = turn[k.rem_euclid(n) as usize];
                [micro(x), micro(y), z.round() as i64]
            })
            .collect()
    }

    /// Height from one lead knot to the next, micrometres.
    fn lead_rise(&self) -> f64 {
        let share = match self.distribution {
            Distribution::Polar => f64::from(self.parameter) / APPROACH_DEGREES,
            Distribution::Equidistant => {
                let step = contour::arc_length(0.0, TAU) / f64::from(self.distinct());
                step / contour::arc_length(0.0, APPROACH_DEGREES.to_radians())
            }
        };
        APPROACH_HEIGHT * share
    }
}

/// One closed turn of the contour enlarged by `scale`, a knot every `degrees`, at z = -6 mm.
#[must_use]
pub fn roughing(degrees: u32, scale: f64) -> Vec<Knot> {
    (0..=360 / degrees)
        .map(|k| {
            let [x, y] = contour::point(f64::from(k * degrees).to_radians());
            [micro(scale * x), micro(scale * y), DEPTH]
        })
        .collect()
}

/// `mm` in micrometres, to nearest.
fn micro(mm: f64) -> i64 {
    (1000.0 * mm).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sets_have_the_printed_counts() {
        let counts = FINISHING.map(|set| set.printed_count());
        assert_eq!(counts, [360, 72, 24, 357, 177, 57]);
        for set in FINISHING {
            let knots = set.finishing();
            assert_eq!(
                knots.len() as u32,
                3 * set.distinct() + 1 + 2 * set.leads,
                "{set:?}"
            );
            let depth = knots.iter().filter(|knot| knot[2] == DEPTH).count();
            assert_eq!(depth as u32, set.distinct() + 1);
        }
        // Table 2.2.3.2: total of a single turn with its leads.
        let totals = [3, 4, 5].map(|i| FINISHING[i].printed_count() + 2 * FINISHING[i].leads);
        assert_eq!(totals, [381, 189, 61]);
    }

    #[test]
    fn knots_of_five_degrees_are_the_printed_ones() {
        // Table 2.3.2.2.
        let printed = [
            [22_000, 0],
            [21_330, 1866],
            [19_577, 3452],
            [17_387, 4659],
            [15_475, 5632],
            [14_295, 6666],
            [13_856, 8000],
            [13_774, 9645],
            [13_523, 11_347],
            [12_728, 12_728],
        ];
        let knots = FINISHING[1].finishing();
        for (knot, [x, y]) in knots[3..].iter().zip(printed) {
            assert_eq!(knot[..2], [x, y]);
        }
        // Table 2.3.2.1.1: the lead knot at -15 degrees, `X17.387 Y-4.659 Z0.250`.
        assert_eq!(knots[0], [17_387, -4659, 250]);
        assert_eq!(knots.last(), Some(&[17_387, 4659, 250]));
    }

    #[test]
    fn distances_between_equidistant_knots_are_the_printed_ones() {
        // Table 2.2.2.1 prints the length over the number of points with the closing one counted.
        for (set, printed) in [
            (FINISHING[3], 0.381_48),
            (FINISHING[4], 0.769_43),
            (FINISHING[5], 2.389_29),
        ] {
            let mean = contour::PRINTED_LENGTH_MM / f64::from(set.printed_count());
            assert!((mean - printed).abs() < 6e-6, "{mean}");
            let turn = set.turn();
            for (a, b) in turn.iter().zip(turn.iter().cycle().skip(1)) {
                let chord = (a[0] - b[0]).hypot(a[1] - b[1]);
                let arc = contour::PRINTED_LENGTH_MM / f64::from(set.distinct());
                assert!(chord <= arc + 1e-6 && chord > 0.9 * arc);
            }
        }
    }

    #[test]
    fn every_turn_is_symmetric_about_both_axes() {
        for set in FINISHING {
            let all: Vec<[i64; 2]> = set.turn().iter().map(|p| p.map(micro)).collect();
            for &[x, y] in &all {
                assert!(all.contains(&[-x, y]) && all.contains(&[x, -y]), "{set:?}");
            }
        }
    }
}
