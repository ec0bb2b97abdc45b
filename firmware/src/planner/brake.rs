//! Braking: how far it takes, and exact landings in whole ticks.

use crate::interpolator::{PathState, T_FRAC};
use crate::units::{larger, smaller, sqrt};

/// The three phases of a jerk-limited change down to a lower velocity: build up deceleration, hold it, let it go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brake {
    /// Durations, s.
    pub time: [f32; 3],
    /// Path covered, path units.
    pub distance: f32,
}

impl Brake {
    /// Durations in whole ticks of a clock of `hz`, rounded up, one at least.
    #[must_use]
    pub fn ticks(&self, hz: f32) -> [u32; 3] {
        self.time.map(|t| (libm::ceilf(t * hz) as u32).max(1))
    }
}

/// What may be done while braking, all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Deceleration, path units/s^2.
    pub a: f32,
    /// Jerk that builds it up, path units/s^3.
    pub down: f32,
    /// Jerk that lets it go.
    pub up: f32,
}

impl Grip {
    /// The same jerk for both.
    #[must_use]
    pub fn even(a: f32, j: f32) -> Self {
        Self { a, down: j, up: j }
    }

    /// The lesser of both in everything.
    #[must_use]
    pub fn least(self, other: Self) -> Self {
        Self {
            a: smaller(self.a, other.a),
            down: smaller(self.down, other.down),
            up: smaller(self.up, other.up),
        }
    }

    /// A share of it: slower braking of the same shape takes the share of deceleration, and its power of 3/2 of jerk would
    /// keep the shape in time; jerk and deceleration together by the same share is simpler and as good.
    #[must_use]
    pub fn share(self, share: f32) -> Self {
        Self {
            a: self.a * share,
            down: self.down * share,
            up: self.up * share,
        }
    }
}

/// Braking from velocity `v` and acceleration `a` to velocity `to` with zero acceleration, within `grip`.
///
/// Phase one ends at the peak deceleration p with `p^2 (1 / down + 1 / up) / 2 = v - to + a^2 / (2 down)` unless the
/// deceleration allowed caps it. If the motion already decelerates so hard that it ends below `to`, only the release is left.
#[must_use]
pub fn brake(v: f32, a: f32, to: f32, grip: Grip) -> Brake {
    let Grip { down, up, .. } = grip;
    let given = if a > 0.0 {
        a * a / (2.0 * down)
    } else {
        -a * a / (2.0 * up)
    };
    if v - to + given <= 0.0 {
        // Nothing left but to bring the acceleration to zero.
        let j = if a > 0.0 { down } else { up };
        let t = a.abs() / j;
        let d = v * t + a * t * t / 2.0 - j.copysign(a) * t * t * t / 6.0;
        return Brake {
            time: [0.0, 0.0, t],
            distance: larger(0.0, d),
        };
    }
    let drop = v - to + a * a / (2.0 * down);
    let half = 0.5 / down + 0.5 / up;
    let p = smaller(larger(grip.a, -a), sqrt(drop / half));
    let t1 = larger(0.0, (a + p) / down);
    let t2 = larger(0.0, (drop - p * p * half) / p);
    let t3 = p / up;
    let d1 = t1 * (v + t1 * (a / 2.0 - down * t1 / 6.0));
    let v1 = v + t1 * (a - down * t1 / 2.0);
    let d2 = t2 * (v1 - p * t2 / 2.0);
    let v2 = v1 - p * t2;
    let d3 = t3 * (v2 + t3 * (-p / 2.0 + up * t3 / 6.0));
    Brake {
        time: [t1, t2, t3],
        distance: d1 + d2 + d3,
    }
}

/// Three jerks over whole ticks.
pub type Phases = [(i64, u32); 3];

/// What one unit of jerk over `n` ticks, followed by `rest` ticks, adds to (a, v, s) at the end.
fn effect(n: f64, rest: f64) -> [f64; 3] {
    let n2 = n * (n + 1.0) / 2.0;
    [
        n,
        n2 + n * rest,
        n * (n + 1.0) * (n + 2.0) / 6.0 + rest * n2 + n * rest * (rest + 1.0) / 2.0,
    ]
}

/// Jerks that bring `state` to rest after exactly `distance` (same integer unit as `state.s`) with the phase
/// lengths given: three linear equations in three jerks, solved by Cramer's rule.
///
/// Planning happens in `f32`; this one step needs more and uses software `f64`, a few hundred operations per stop.
/// A second pass solves for the exact integer residue of the first; what is left is the rounding of three
/// jerks, at most n^3/6 units of 2^-72. `None` if that is more than 2^-42 path units (phases of a second and more).
#[must_use]
pub fn land(state: &PathState, distance: i128, ticks: [u32; 3]) -> Option<Phases> {
    let n = ticks.map(f64::from);
    let [x, y, z] = [
        effect(n[0], n[1] + n[2]),
        effect(n[1], n[2]),
        effect(n[2], 0.0),
    ];
    let d = determinant(&x, &y, &z);
    if d == 0.0 {
        return None;
    }
    let mut phases = [(0_i64, ticks[0]), (0, ticks[1]), (0, ticks[2])];
    let target = state.s.checked_add(distance)?;
    for _ in 0..2 {
        let end = run(state, &phases)?;
        let right = [
            -(end.a as f64),
            -(end.v as f64),
            target.checked_sub(end.s)? as f64,
        ];
        phases[0].0 = phases[0]
            .0
            .checked_add(round(determinant(&right, &y, &z) / d))?;
        phases[1].0 = phases[1]
            .0
            .checked_add(round(determinant(&x, &right, &z) / d))?;
        phases[2].0 = phases[2]
            .0
            .checked_add(round(determinant(&x, &y, &right) / d))?;
    }
    let end = run(state, &phases)?;
    let missed = target.checked_sub(end.s)?;
    const FINE: i128 = 1 << (T_FRAC - 42);
    (missed.abs() < FINE && end.v.abs() < FINE).then_some(phases)
}

fn determinant(x: &[f64; 3], y: &[f64; 3], z: &[f64; 3]) -> f64 {
    x[0] * (y[1] * z[2] - z[1] * y[2]) - y[0] * (x[1] * z[2] - z[1] * x[2])
        + z[0] * (x[1] * y[2] - y[1] * x[2])
}

fn round(x: f64) -> i64 {
    libm::round(x) as i64
}

/// State after all phases, or `None` out of range.
fn run(state: &PathState, phases: &Phases) -> Option<PathState> {
    phases
        .iter()
        .try_fold(*state, |state, &(j, n)| state.after(j, n))
}

/// Jerks that bring `state` to velocity `to` and zero acceleration, wherever that is: two equations, the middle
/// phase keeps its deceleration.
#[must_use]
pub fn slow(state: &PathState, to: i128, ticks: [u32; 3]) -> Option<Phases> {
    let n = ticks.map(f64::from);
    let (x, z) = (effect(n[0], n[1] + n[2]), effect(n[2], 0.0));
    let d = x[0] * z[1] - z[0] * x[1];
    if d == 0.0 {
        return None;
    }
    let mut phases = [(0_i64, ticks[0]), (0, ticks[1]), (0, ticks[2])];
    for _ in 0..2 {
        let end = run(state, &phases)?;
        let right = [-(end.a as f64), (to - end.v) as f64];
        phases[0].0 = phases[0]
            .0
            .checked_add(round((right[0] * z[1] - z[0] * right[1]) / d))?;
        phases[2].0 = phases[2]
            .0
            .checked_add(round((x[0] * right[1] - right[0] * x[1]) / d))?;
    }
    Some(phases)
}

/// Rest-to-rest move over `distance` in four phases of `m`, `2 m`, `m` ticks: the time-optimal shape where only
/// jerk binds. Returns the jerk: s_end = 2 m^3 j in this discrete form, exactly.
#[must_use]
pub fn hop(distance: i128, m: u32) -> i64 {
    let divisor = 2 * i128::from(m).pow(3);
    ((distance + divisor / 2) / divisor) as i64
}

/// Jerks from rest to rest over `distance`: an acceleration for `n` ticks at once and the same against it, with `pause` ticks
/// (none or one) between; the time-optimal shape where only acceleration binds. s_end = n (n + pause) a in this discrete form,
/// exactly, after 2 n + pause ticks, with no velocity left; what is left of the acceleration ends with the motion. The first ones
/// may be empty. `None` where a jerk is out of range.
#[must_use]
pub fn dash(distance: i128, n: u32, pause: u32) -> Option<[(i64, u32); 4]> {
    let divisor = i128::from(n) * i128::from(n + pause);
    let a = (distance + divisor / 2).checked_div(divisor)?;
    let a = i64::try_from(a).ok()?;
    let over = if pause == 0 {
        (a.checked_mul(-2)?, 1)
    } else {
        (-a, 2)
    };
    Some(match n {
        1 => [(0, 0), (0, 0), (a, 1), over],
        _ => [(a, 1), (0, n - 1), over, (0, n - 1)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick_by_tick(mut state: PathState, phases: &[(i64, u32)]) -> PathState {
        for &(j, n) in phases {
            for _ in 0..n {
                state.step(j);
            }
        }
        state
    }

    #[test]
    fn closed_form_steps_are_the_same_integers() {
        let start = PathState {
            s: 123,
            v: -77_777,
            a: 991,
        };
        for n in [0, 1, 2, 17, 400] {
            assert_eq!(start.after(-13, n), Some(tick_by_tick(start, &[(-13, n)])));
        }
    }

    #[test]
    fn a_landing_ends_at_rest_on_the_point() {
        let one = (1_i128 << T_FRAC) as f64;
        // 25 mm/s and -1000 mm/s^2 at 5 kHz.
        let state = PathState {
            s: 0,
            v: (0.005 * one) as i128,
            a: (-4e-5 * one) as i128,
        };
        for ticks in [[150, 10, 180], [300, 1, 250], [40, 300, 60]] {
            let distance = (0.7 * one) as i128;
            let end = tick_by_tick(state, &land(&state, distance, ticks).unwrap());
            let n = f64::from(ticks.iter().sum::<u32>());
            assert!(
                (end.s - distance).abs() as f64 <= n * n * n / 6.0,
                "{end:?}"
            );
            assert!((end.v.abs() as f64) <= n * n / 2.0 && (end.a.abs() as f64) <= n);
        }
    }

    #[test]
    fn a_hop_is_exact() {
        for m in [1_u32, 2, 9, 200] {
            let distance = 2 * i128::from(m).pow(3) * 12_345;
            let j = hop(distance, m);
            assert_eq!(j, 12_345);
            let end = tick_by_tick(PathState::default(), &[(j, m), (-j, 2 * m), (j, m)]);
            assert_eq!(
                end,
                PathState {
                    s: distance,
                    v: 0,
                    a: 0
                }
            );
        }
    }

    #[test]
    fn a_dash_is_exact_and_keeps_one_acceleration() {
        for (n, pause) in [(1, 0), (1, 1), (2, 0), (7, 1), (150, 0)] {
            let distance = i128::from(n) * i128::from(n + pause) * 12_345;
            let phases = dash(distance, n, pause).unwrap();
            let mut state = PathState::default();
            let mut ticks = 0;
            for (jerk, n) in phases {
                for _ in 0..n {
                    state.step(jerk);
                    assert!(state.a.abs() == 12_345 || state.a == 0, "{state:?}");
                    ticks += 1;
                }
            }
            let end = PathState {
                s: distance,
                v: 0,
                a: -12_345,
            };
            assert_eq!((state, ticks), (end, 2 * n + pause));
        }
    }

    /// The distance formula against plain numerical integration of the three phases (f64, 1 us steps).
    #[test]
    fn brake_distance_is_the_integral() {
        for (v, a, to) in [
            (100.0, 0.0, 0.0),
            (30.0, 2000.0, 5.0),
            (30.0, -900.0, 0.0),
            (667.0, 10.0, 0.0),
            (10.0, -980.0, 0.0),
        ] {
            let b = brake(v, a, to, Grip::even(5000.0, 50_000.0));
            let (mut x, mut vel, mut acc) = (0.0_f64, f64::from(v), f64::from(a));
            let h = 1e-6;
            for (t, j) in [
                (b.time[0], -50_000.0),
                (b.time[1], 0.0),
                (b.time[2], 50_000.0),
            ] {
                for _ in 0..(f64::from(t) / h).round() as usize {
                    x += vel * h + acc * h * h / 2.0;
                    vel += acc * h + j * h * h / 2.0;
                    acc += j * h;
                }
            }
            assert!(
                (vel - f64::from(to)).abs() < 0.3,
                "v {v} a {a}: ends at {vel}"
            );
            assert!(
                (x - f64::from(b.distance)).abs() < 1e-3 * x.abs() + 1e-3,
                "{x} {}",
                b.distance
            );
        }
    }
}
