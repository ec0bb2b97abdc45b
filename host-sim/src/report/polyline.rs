//! A path of any length as a polyline of bounded size.
//!
//! In: one point per tick with its feed. Out: at most [`MAX_POINTS`] vertices such that every point lies within a tolerance of the
//! polyline. The tolerance starts far below what a screen can show and doubles when the vertices are used up.

/// Vertices of one path.
pub const MAX_POINTS: usize = 4000;
/// First tolerance, mm.
const TOLERANCE_MM: f64 = 0.0005;
/// The feed is a fourth coordinate of this many mm per mm/s, so that its changes along a straight line stay visible.
const MM_PER_FEED: f64 = 0.001;
/// Points between two vertices that are looked at again for each new point.
const WINDOW: usize = 48;

/// A vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Position, mm.
    pub at: [f64; 3],
    /// Feed, mm/s.
    pub feed: f64,
    /// Text line.
    pub line: u32,
}

impl PathPoint {
    fn coordinates(&self) -> [f64; 4] {
        let [x, y, z] = self.at;
        [x, y, z, self.feed * MM_PER_FEED]
    }
}

/// Path that thins itself out.
#[derive(Clone, Debug)]
pub struct Polyline {
    kept: Vec<PathPoint>,
    /// Points after the last vertex; all lie within the tolerance of the chord to the last of them.
    pending: Vec<PathPoint>,
    tolerance: f64,
}

impl Polyline {
    /// Empty path.
    pub fn new() -> Self {
        Self {
            kept: Vec::new(),
            pending: Vec::new(),
            tolerance: TOLERANCE_MM,
        }
    }

    /// Takes the next point in.
    pub fn push(&mut self, at: [f64; 3], feed: f64, line: u32) {
        self.append(PathPoint { at, feed, line });
        while self.kept.len() >= MAX_POINTS {
            // A second pass alone merges what the window cut; only then give up accuracy.
            let before = core::mem::take(&mut self.kept);
            let pending = core::mem::take(&mut self.pending);
            let count = before.len();
            before
                .into_iter()
                .chain(pending)
                .for_each(|p| self.append(p));
            if self.kept.len() > count / 2 {
                self.tolerance *= 2.0;
            }
        }
    }

    fn append(&mut self, point: PathPoint) {
        let Some(&anchor) = self.kept.last() else {
            self.kept.push(point);
            return;
        };
        let last = self.pending.last().copied().unwrap_or(anchor);
        if last.coordinates() == point.coordinates() {
            return;
        }
        let straight = self
            .pending
            .iter()
            .all(|p| off_chord(anchor, point, *p) <= self.tolerance);
        if !straight || self.pending.len() >= WINDOW {
            self.kept.push(last);
            self.pending.clear();
        }
        self.pending.push(point);
    }

    /// Vertices including the end of the path.
    pub fn points(&self) -> impl Iterator<Item = &PathPoint> {
        self.kept.iter().chain(self.pending.last())
    }

    /// Largest distance of a point that was dropped from the polyline, as far as one pass goes, mm.
    #[cfg(test)]
    fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// Distance of `p` from the segment `a`-`b`.
fn off_chord(a: PathPoint, b: PathPoint, p: PathPoint) -> f64 {
    let (a, b, p) = (a.coordinates(), b.coordinates(), p.coordinates());
    let (mut along, mut squared) = (0.0, 0.0);
    for k in 0..4 {
        along += (p[k] - a[k]) * (b[k] - a[k]);
        squared += (b[k] - a[k]) * (b[k] - a[k]);
    }
    let t = if squared > 0.0 {
        (along / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let off = |k: usize| a[k] + t * (b[k] - a[k]) - p[k];
    (0..4).map(|k| off(k) * off(k)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nearest(polyline: &Polyline, p: PathPoint) -> f64 {
        let vertices: Vec<_> = polyline.points().copied().collect();
        vertices
            .windows(2)
            .map(|pair| off_chord(pair[0], pair[1], p))
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn corners_stay_and_straights_cost_nothing() {
        let mut path = Polyline::new();
        let mut count = 0;
        for leg in 0..4 {
            for i in 0..50_000 {
                let s = f64::from(i) / 50_000.0;
                let at = [[s, 0.0], [1.0, s], [1.0 - s, 1.0], [0.0, 1.0 - s]][leg];
                path.push([at[0], at[1], 0.0], 5.0, 1);
                count = path.points().count().max(count);
            }
        }
        assert!(count <= MAX_POINTS + 1);
        for corner in [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            let found = path
                .points()
                .any(|p| (p.at[0] - corner[0]).hypot(p.at[1] - corner[1]) < 4.0 * TOLERANCE_MM);
            assert!(found, "{corner:?}");
        }
    }

    #[test]
    fn every_point_stays_near_the_thinned_path() {
        let at = |i: u32| {
            let t = f64::from(i) * 1e-4;
            let r = 18.0 + 4.0 * (2.0 * t).cos() * (6.0 * t).cos();
            [r * t.cos(), r * t.sin(), -0.01 * t]
        };
        let mut path = Polyline::new();
        for i in 0..200_000 {
            path.push(at(i), 25.0, 1);
        }
        assert!(path.points().count() <= MAX_POINTS + 1);
        // Each pass may add its own tolerance; they form a geometric series below twice the last one,
        // passes at an unchanged tolerance aside.
        let allowed = 4.0 * path.tolerance();
        assert!(allowed < 0.02, "{allowed}");
        for i in (0..200_000).step_by(997) {
            let p = PathPoint {
                at: at(i),
                feed: 25.0,
                line: 1,
            };
            assert!(nearest(&path, p) <= allowed);
        }
    }
}
