//! Is a path at the distance of the tool radius from a contour? No construction of the path, only the measure.
//!
//! In: the contour as dense points in the plane of compensation, the centres the tool has been at. Out: the smallest
//! distance of any centre from the contour (a gouge if it is less than the radius), and the largest.

use std::collections::HashMap;

/// Polyline in a plane with an index by squares, so that distances are found without looking at all of it.
#[derive(Clone, Debug)]
pub struct Contour {
    points: Vec<[f64; 2]>,
    side: f64,
    squares: HashMap<(i64, i64), Vec<u32>>,
}

/// How a set of centres lies beside a contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Smallest distance, mm.
    pub least: f64,
    /// Largest distance, mm.
    pub most: f64,
    /// Centres on the left of the contour, as a share.
    pub left: f64,
}

impl Contour {
    /// A contour through the points of `dense`, to be asked about distances of up to `reach`.
    ///
    /// Points next to their predecessor (1e-5 mm) are left out: printed ends of arcs miss the next block by a hair, and
    /// such hairs point anywhere.
    #[must_use]
    pub fn new(dense: impl IntoIterator<Item = [f64; 2]>, reach: f64) -> Self {
        let side = reach.max(1e-3);
        let mut points: Vec<[f64; 2]> = Vec::new();
        for p in dense {
            if points
                .last()
                .is_none_or(|q| (p[0] - q[0]).hypot(p[1] - q[1]) > 1e-5)
            {
                points.push(p);
            }
        }
        let mut squares: HashMap<(i64, i64), Vec<u32>> = HashMap::new();
        for (k, pair) in (0..).zip(points.windows(2)) {
            let cell = |f: fn(f64, f64) -> f64, axis: usize| {
                (f(pair[0][axis], pair[1][axis]) / side).floor() as i64
            };
            for x in cell(f64::min, 0)..=cell(f64::max, 0) {
                for y in cell(f64::min, 1)..=cell(f64::max, 1) {
                    squares.entry((x, y)).or_default().push(k);
                }
            }
        }
        Self {
            points,
            side,
            squares,
        }
    }

    /// Distance of `q` from the contour, and whether it lies on its left; `None` beyond the reach.
    ///
    /// At a corner the side is that of the sum of the two directions.
    #[must_use]
    pub fn distance(&self, q: [f64; 2]) -> Option<(f64, bool)> {
        let cell = q.map(|x| (x / self.side).floor() as i64);
        let mut best: Option<(f64, f64)> = None;
        for x in cell[0] - 1..=cell[0] + 1 {
            for y in cell[1] - 1..=cell[1] + 1 {
                for &k in self.squares.get(&(x, y)).into_iter().flatten() {
                    let (a, b) = (self.points[k as usize], self.points[k as usize + 1]);
                    let (d, v) = ([b[0] - a[0], b[1] - a[1]], [q[0] - a[0], q[1] - a[1]]);
                    let square = d[0] * d[0] + d[1] * d[1];
                    if square == 0.0 {
                        continue;
                    }
                    let t = ((d[0] * v[0] + d[1] * v[1]) / square).clamp(0.0, 1.0);
                    let away = (v[0] - t * d[0]).hypot(v[1] - t * d[1]);
                    let cross = (d[0] * v[1] - d[1] * v[0]) / square.sqrt();
                    best = match best {
                        // Two neighbours share a corner: the one that sees more of the side decides.
                        Some((least, side)) if (away - least).abs() < 1e-9 => Some((
                            least.min(away),
                            if cross.abs() > side.abs() {
                                cross
                            } else {
                                side
                            },
                        )),
                        Some((least, side)) if least < away => Some((least, side)),
                        _ => Some((away, cross)),
                    };
                }
            }
        }
        best.map(|(away, cross)| (away, cross > 0.0))
    }

    /// Clearance of all `centres`.
    ///
    /// # Errors
    /// The first centre that is farther away than the reach.
    pub fn clearance(
        &self,
        centres: impl IntoIterator<Item = [f64; 2]>,
    ) -> Result<Clearance, String> {
        let (mut least, mut most, mut left, mut count) = (f64::INFINITY, 0.0_f64, 0.0, 0.0);
        for (k, q) in centres.into_iter().enumerate() {
            let (away, side) = self
                .distance(q)
                .ok_or_else(|| format!("centre {k} at {q:?} is far off the contour"))?;
            least = least.min(away);
            most = most.max(away);
            left += f64::from(u8::from(side));
            count += 1.0;
        }
        Ok(Clearance {
            least,
            most,
            left: left / count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_and_sides_are_those_of_the_nearest_line() {
        let contour = Contour::new([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]], 3.0);
        assert_eq!(contour.distance([5.0, 2.0]), Some((2.0, true)));
        assert_eq!(contour.distance([5.0, -2.0]), Some((2.0, false)));
        assert_eq!(contour.distance([12.0, 5.0]), Some((2.0, false)));
        let (away, left) = contour.distance([11.0, -1.0]).expect("near");
        assert!((away - 2.0_f64.sqrt()).abs() < 1e-12 && !left);
        assert_eq!(contour.distance([50.0, 50.0]), None);
        let seen = contour
            .clearance([[5.0, 2.0], [8.0, 2.0], [8.0, 2.5]])
            .expect("near");
        assert_eq!((seen.least, seen.left), (2.0, 1.0));
    }
}
