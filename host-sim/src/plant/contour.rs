//! Contour error: how far the tool is from the commanded path, whatever its lag along the path.
//!
//! In: commanded and actual point of each tick, mm. Out: the distance from the actual point to the commanded
//! polyline, `window` ticks late, because a drive can also lead (it overshoots while braking) and then the
//! nearest point is one that has not been commanded yet.

use std::collections::VecDeque;

/// A commanded point and where it lies on the path.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    /// Last tick that commanded this point.
    tick: u64,
    /// Length of the polyline up to here, mm.
    arc: f64,
    point: [f64; 3],
}

/// Measures the contour error over a window of `window` commanded points back and `window` ticks ahead.
#[derive(Clone, Debug)]
pub struct ContourMeter {
    window: usize,
    tick: u64,
    /// Commanded polyline of the window; consecutive vertices differ.
    path: VecDeque<Vertex>,
    /// Actual points that wait for the path ahead of them.
    waiting: VecDeque<[f64; 3]>,
    max: f64,
}

impl ContourMeter {
    /// Empty meter. The result of a tick comes `window` ticks later.
    #[must_use]
    pub fn new(window: usize) -> Self {
        Self {
            window,
            tick: 0,
            path: VecDeque::new(),
            waiting: VecDeque::new(),
            max: 0.0,
        }
    }

    /// Takes the next tick in; returns the error of the tick `window` ticks ago, mm.
    pub fn push(&mut self, commanded: [f64; 3], actual: [f64; 3]) -> Option<f64> {
        match self.path.back_mut() {
            // A dwell is one vertex, kept for as long as it lasts.
            Some(last) if last.point == commanded => last.tick = self.tick,
            Some(&mut Vertex { arc, point, .. }) => self.path.push_back(Vertex {
                tick: self.tick,
                arc: arc + distance(point, commanded),
                point: commanded,
            }),
            None => self.path.push_back(Vertex {
                tick: self.tick,
                arc: 0.0,
                point: commanded,
            }),
        }
        self.waiting.push_back(actual);
        self.tick += 1;
        if self.waiting.len() > self.window {
            self.measure()
        } else {
            None
        }
    }

    /// Errors of all ticks that still wait, in order; the path is taken to end where it is.
    pub fn finish(&mut self) -> VecDeque<f64> {
        core::iter::from_fn(|| self.measure()).collect()
    }

    /// Largest error measured so far, mm.
    #[must_use]
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Error of the tick that waits longest.
    fn measure(&mut self) -> Option<f64> {
        let measured_tick = self.tick - self.waiting.len() as u64;
        let actual = self.waiting.pop_front()?;
        // Vertices count, not ticks: a tool that creeps up to its stop still has the way there behind it.
        let mut current = self.path.partition_point(|v| v.tick < measured_tick);
        while current > self.window {
            self.path.pop_front();
            current -= 1;
        }
        let error = nearest(&self.path, current, actual);
        self.max = self.max.max(error);
        Some(error)
    }
}

/// Distance from `p` to the polyline; `hint` is the index of a vertex that is probably near.
///
/// The distance changes by at most as much as the arc length does, so a vertex at distance d cannot hide a
/// point nearer than `best` within d - best of arc on either side; the search jumps over that stretch. The
/// result is the exact minimum, at a cost of a few vertices per call.
fn nearest(path: &VecDeque<Vertex>, hint: usize, p: [f64; 3]) -> f64 {
    let Some(last) = path.back() else {
        return 0.0;
    };
    let mut best = distance(path.get(hint).unwrap_or(last).point, p);
    let mut i = 0;
    while i < path.len() {
        let here = path[i];
        let d = distance(here.point, p);
        best = best.min(d);
        if i + 1 < path.len() {
            best = best.min(to_segment(here.point, path[i + 1].point, p));
        }
        let clear = here.arc + (d - best);
        if clear >= last.arc {
            break;
        }
        // The segment that contains `clear` starts one vertex earlier.
        i = match path.get(i + 2) {
            Some(next) if next.arc <= clear => path.partition_point(|v| v.arc <= clear) - 1,
            _ => i + 1,
        };
    }
    best
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

/// Distance from `p` to the segment `a`-`b`.
fn to_segment(a: [f64; 3], b: [f64; 3], p: [f64; 3]) -> f64 {
    let (mut along, mut squared) = (0.0, 0.0);
    for k in 0..3 {
        along += (p[k] - a[k]) * (b[k] - a[k]);
        squared += (b[k] - a[k]) * (b[k] - a[k]);
    }
    let t = if squared > 0.0 {
        (along / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    distance(core::array::from_fn(|k| a[k] + t * (b[k] - a[k])), p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every segment of the window, no skipping.
    fn brute_force(commands: &[[f64; 3]], p: [f64; 3]) -> f64 {
        // Dense sampling of each segment: another method than the projection above.
        let mut best = f64::INFINITY;
        for pair in commands.windows(2) {
            for i in 0..=2000 {
                let t = f64::from(i) / 2000.0;
                let q = core::array::from_fn(|k| pair[0][k] * (1.0 - t) + pair[1][k] * t);
                best = best.min(distance(q, p));
            }
        }
        best
    }

    #[test]
    fn skipping_finds_the_nearest_point_of_the_window() {
        let mut seed = 12345u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        const WINDOW: usize = 12;
        let mut meter = ContourMeter::new(WINDOW);
        let (mut commands, mut actuals) = (vec![[0.0; 3]; 0], vec![[0.0; 3]; 0]);
        let (mut at, mut errors) = ([0.0; 3], Vec::new());
        for _ in 0..200 {
            for x in &mut at {
                *x += random();
            }
            commands.push(at);
            let actual = core::array::from_fn(|k| at[k] + 2.0 * random());
            actuals.push(actual);
            errors.extend(meter.push(at, actual));
        }
        errors.extend(meter.finish());
        assert_eq!(errors.len(), actuals.len());
        for (i, &error) in errors.iter().enumerate() {
            let window = i.saturating_sub(WINDOW)..(i + WINDOW + 1).min(commands.len());
            let oracle = brute_force(&commands[window], actuals[i]);
            assert!(
                (error - oracle).abs() < 1e-3,
                "tick {i}: {error} against {oracle}"
            );
        }
        assert_eq!(meter.max(), errors.iter().fold(0.0, |m: f64, &e| m.max(e)));
    }

    #[test]
    fn a_lead_along_the_path_is_no_contour_error_and_an_overshoot_is() {
        let mut meter = ContourMeter::new(5);
        let mut errors = Vec::new();
        for i in 0..20 {
            let x = f64::from(i.min(10));
            let actual = if i < 10 { x + 0.7 } else { 10.3 };
            errors.extend(meter.push([x, 0.0, 0.0], [actual.min(10.3), 0.0, 0.0]));
        }
        errors.extend(meter.finish());
        assert!(errors[..9].iter().all(|&e| e < 1e-12));
        assert!(errors[10..].iter().all(|&e| (e - 0.3).abs() < 1e-12));
    }
}
