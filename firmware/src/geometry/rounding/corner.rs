//! One corner: whether it is rounded, and how far back.
//!
//! In: the segment that ends there, the one that begins there, what the program allows. Out: the cubics and what is left of
//! the two segments, or nothing: then the corner stays as it is programmed.

use super::blend::{sag, Blend, Cubics, Shape};
use super::branch::{Branch, Side, Spot};
use super::Held;
use crate::config::Config;
use crate::geometry::segment::{HermiteSegment, PathSegment};
use crate::nc::command::Rounding;
use crate::units::{sqrt, AxisVec, AXES};

/// Share of a segment that its end may take; the other half belongs to its start.
const HALF: f32 = 0.5;
/// Change of dq/ds below which there is no corner: what the rounding of slopes makes of a smooth joint.
const TANGENT: f32 = 5.0e-6;
/// Turn below which a polyline may stand for a curve, radian.
const GENTLE: f32 = 0.35;
/// Cosine of the turn beyond which the path goes back the way it came (169 degrees); rounded, it would miss the point.
const REVERSAL: f32 = -0.98;
/// Largest ratio of the two distances: beyond it the curve would swing back.
const RATIO: f32 = 2.0;
/// What is left between two rounded corners is at least this share of either half, or nothing: a sliver would hold the
/// machine up, which passes one joint per tick.
const SLIVER: f32 = 0.1;
/// Shortest distance worth rounding, mm or degree.
const LEAST: f32 = 1.0e-3;
/// Share of a tolerance that is used; the rest is for the rounding of numbers.
const USED: f32 = 0.98;
/// Places where the curve between curved segments is compared with them.
const SAMPLES: u8 = 16;
/// Times the distances are cut before such a corner is left alone, and to what share.
const TRIES: usize = 8;
const CUT: f32 = 0.7;

/// A rounded corner.
pub(super) struct Corner {
    /// What is left of the first segment.
    pub before: Option<HermiteSegment>,
    /// What takes the place of the corner.
    pub cubics: Cubics,
    /// What is left of the second segment.
    pub behind: Option<HermiteSegment>,
    /// Share of what is left that the end of the second segment may take.
    pub share: f32,
}

/// The two legs of a corner.
struct Legs {
    before: Branch,
    behind: Branch,
    /// Shares of them that may go.
    most: [f32; 2],
    /// Change of dq/ds.
    turn: AxisVec,
    /// Cosine of the turn over the axes that count.
    cosine: f32,
}

impl Corner {
    /// The corner between `held` and `next`; `None` where it stays.
    pub fn new(config: &Config, held: &Held, next: &PathSegment) -> Option<Self> {
        let path = &held.path;
        // A change between feed and rapid motion is a programmed point of its own.
        if path.exact_stop
            || path.rounding == Rounding::None
            || path.feed.is_infinite() != next.feed.is_infinite()
            || path.segment.end != next.segment.start
        {
            return None;
        }
        let before = Branch::new(config, &path.segment, Side::Before)?;
        let behind = Branch::new(config, &next.segment, Side::Behind)?;
        if before.counts != behind.counts {
            return None;
        }
        let (t0, t1) = (before.direction(), behind.direction());
        let turn: AxisVec = core::array::from_fn(|a| t1[a] - t0[a]);
        // Written so that what is not a number is no corner.
        let bent = turn.iter().any(|by| by.abs() > TANGENT);
        let cosine = before.counts.dot(&t0, &t1);
        if !bent || !(cosine > REVERSAL) {
            return None;
        }
        let legs = Legs {
            before,
            behind,
            most: [held.share, HALF],
            turn,
            cosine,
        };
        legs.round(config, path.rounding)
    }
}

impl Legs {
    fn round(&self, config: &Config, rounding: Rounding) -> Option<Corner> {
        let [before, behind] = [(&self.before, self.most[0]), (&self.behind, self.most[1])];
        let room = [before, behind].map(|(branch, most)| branch.distance(most));
        let lines = self.before.straight && self.behind.straight;
        let turned = sqrt(self.before.counts.dot(&self.turn, &self.turn));
        let mut shape = Shape::Smooth;
        let mut distances = self.distances(config, rounding, shape, &room)?;
        if lines && turned < GENTLE {
            // Joints so close that they take all there is between them.
            let even = self.distances(config, rounding, Shape::Even, &room)?;
            if even[0] >= room[0] || even[1] >= room[1] {
                (shape, distances) = (Shape::Even, even);
            }
        }
        for _ in 0..TRIES {
            // Written so that what is not a number is not rounded.
            if !(distances[0] >= LEAST && distances[1] >= LEAST) {
                return None;
            }
            let corner = &self.behind.segment().start;
            let spots = [
                before.0.spot(config, corner, distances[0], before.1)?,
                behind.0.spot(config, corner, distances[1], behind.1)?,
            ];
            let blend = Blend::new(&self.before.counts, shape, &spots[0], &spots[1]);
            if lines || self.stays(config, rounding, &blend, &spots) {
                let [first, last] = &spots;
                return Some(Corner {
                    before: self.before.rest(config, first),
                    cubics: blend.cubics(config, corner, &first.at, &last.at)?,
                    behind: self.behind.rest(config, last),
                    share: (HALF / (1.0 - last.share)).min(1.0),
                });
            }
            distances = distances.map(|distance| CUT * distance);
        }
        None
    }

    /// How far back the path leaves the first leg and how far on it joins the second, for a corner of `shape` between the
    /// tangents of the legs; `room` is what the legs have. `None` where a tolerance of zero forbids any.
    fn distances(
        &self,
        config: &Config,
        rounding: Rounding,
        shape: Shape,
        room: &[f32; 2],
    ) -> Option<[f32; 2]> {
        let limit = match rounding {
            Rounding::None => return None,
            Rounding::Distance(distance) => distance,
            Rounding::Tolerance => {
                let sag = sag(shape, 1.0, 1.0, self.cosine);
                let mut limit = f32::MAX;
                for (axis, by) in config.axes.iter().zip(&self.turn) {
                    // An axis that does not turn only gives its rounding away.
                    if by.abs() > TANGENT {
                        limit = limit.min(USED * axis.rounding_tolerance / (sag * by.abs()));
                    }
                }
                limit
            }
        };
        let fit = |limit: f32, room: f32| {
            if limit >= room {
                room
            } else {
                limit.min((1.0 - SLIVER) * room)
            }
        };
        // Where one is less, the other gives no more than it would to its like: uneven distances keep the tolerance, too.
        let [before, behind] = room.map(|room| fit(limit, room));
        Some([
            fit(before.min(RATIO * behind), room[0]),
            fit(behind.min(RATIO * before), room[1]),
        ])
    }

    /// True if the curve between legs that are no lines keeps what is asked for: the tolerance of every axis, or the
    /// distance to the corner. Compared with the place on the leg that a line would have; the true distance is less.
    fn stays(&self, config: &Config, rounding: Rounding, blend: &Blend, spots: &[Spot; 2]) -> bool {
        let [first, last] = spots;
        let whole = first.distance + last.distance;
        let bend = first.distance / whole;
        (1..SAMPLES).all(|index| {
            let t = f32::from(index) / f32::from(SAMPLES);
            let at = blend.place(t);
            let programmed = if t < bend {
                self.before.place(first.share * (1.0 - t / bend))
            } else {
                self.behind.place(last.share * (t - bend) / (1.0 - bend))
            };
            match rounding {
                Rounding::Tolerance => (0..AXES).all(|a| {
                    (at[a] - programmed[a]).abs() <= USED * config.axes[a].rounding_tolerance
                }),
                _ => {
                    let most = first.distance.max(last.distance);
                    self.before.counts.dot(&at, &at) <= most * most
                }
            }
        })
    }
}
