//! The look-ahead: pieces of the centre path that may still be cut, and how a new piece joins them.
//!
//! In: regular pieces in path order. Out: live pieces that meet each other; whatever is between two that had to be cut back to
//! their crossing has been taken out.
//!
//! A new piece that does not continue the path is tried against the live pieces from the newest back. Where it meets one in
//! a point X, both end there and the contour between is removed: all of it must then lie outside the tool at X (no
//! gouge), and no further from it than the contour tolerance (no material left) and what a tool leaves in any inner corner
//! of the removed contour. X is the position of the tool nearest to the removed contour: the path leaves X on either side at right
//! angles to the radius on which it touches the contour, away from the part between. So the removed contour lies in a ring
//! about X, and no piece whose path is more than `2 r + tolerance` away from it can ever be cut on its account.
//! Pieces leave the window only when it has no room for the next one. What has left cannot be cut: a contour that asks
//! for that is refused.

use heapless::Vec;

use super::corner::{bridge, classify, Joint};
use super::error::{CompensationError, CompensationErrorKind, Place};
use super::intersect::{intersect, Crossing, Part};
use super::offset::{add, cross, dot, left, norm, sub, unit, Point};
use super::piece::{mm, signed_radius, steps, Kind, Piece, State};
use super::Meanwhile;
use crate::config::Config;
use crate::geometry::PathSegment;
use crate::nc::command::{Auxiliary, Command};
use crate::nc::Excerpt;
use crate::units::Position;

/// Items of the look-ahead.
pub(super) const WINDOW: usize = 24;
/// Slots that are free when a new piece arrives: a bridge of two, the piece itself, and a block pushed meanwhile.
pub(super) const RESERVE: usize = 4;
/// The tool may come this much closer to the contour than its radius, mm.
const GOUGE: f64 = 5.0e-4;
/// Ends this close need no crossing, mm.
const TOUCH: f64 = 2.0e-4;
/// Least sine at which two pieces that are no neighbours are held to cross: coincident turns of a helix do not.
const CROSSING: f64 = 0.02;
/// A spline that bends tighter than this share of the tool's radius has rounded an inner corner of its points.
const ROUNDED: f64 = 0.5;
/// An inner joint that turns by more than this, radian, is a corner and no part of a polygon along a curve.
const CORNER_TURN: f64 = 0.35;
/// Turn of the sharpest corner whose material is not counted, radian: 170 degrees.
const SHARPEST: f64 = 2.967;
/// Largest sine between the end of a contour and a retract it turns into.
const ALONG: f64 = 1.0e-3;
/// Most contour that is left at a bend into the way out or from the way in, in radii of the tool.
const LEAD: f64 = 4.0;
/// Samples of a piece where its length is measured and where a clear place is looked for.
const SAMPLES: u32 = 16;
/// Halvings of such a sixteenth: to a millionth of it.
const HALVINGS: u32 = 20;
/// Least sine of a cut.
const CUT: f64 = 1.0e-6;

/// A standstill function, without the room a motion would take.
#[derive(Clone, Copy, Debug)]
pub(super) enum Standstill {
    Dwell(u32),
    Auxiliary(Auxiliary),
    Message(Excerpt),
    ProgramEnd,
}

impl Standstill {
    /// `None` for a motion.
    pub fn new(command: Command) -> Option<Self> {
        match command {
            Command::Dwell { milliseconds } => Some(Self::Dwell(milliseconds)),
            Command::Auxiliary(auxiliary) => Some(Self::Auxiliary(auxiliary)),
            Command::Message(text) => Some(Self::Message(text)),
            Command::ProgramEnd => Some(Self::ProgramEnd),
            Command::Move(_) => None,
        }
    }

    /// The command it came from.
    pub fn command(self) -> Command {
        match self {
            Self::Dwell(milliseconds) => Command::Dwell { milliseconds },
            Self::Auxiliary(auxiliary) => Command::Auxiliary(auxiliary),
            Self::Message(text) => Command::Message(text),
            Self::ProgramEnd => Command::ProgramEnd,
        }
    }
}

/// What waits in the window, in path order.
// All variants but the piece are smaller; boxing needs a heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug)]
pub(super) enum Item {
    /// A piece of the centre path.
    Piece(Piece),
    /// Without motion in the plane: runs wherever the tool stands in it.
    Still(PathSegment),
    /// Straight to the offset of what comes next, once that is known.
    Approach(PathSegment, Option<Point>),
    /// Straight to the programmed end.
    Retract(PathSegment),
    /// As it is.
    Pass(PathSegment),
    /// A standstill function.
    Command(Standstill),
}

/// The end of the contour so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tail {
    /// Unit tangent.
    pub tangent: Point,
    /// The path has been run to the normal offset at this point.
    pub ended: bool,
}

/// Pieces that may still be cut.
pub(super) struct Window {
    pub items: Vec<Item, WINDOW>,
    /// Axes of the plane.
    pub axes: [usize; 2],
    /// `None`: the next piece begins a contour.
    pub tail: Option<Tail>,
    /// Pieces wait for a later one to meet what is before them.
    pub open: bool,
}

impl Window {
    pub const fn new() -> Self {
        Self {
            items: Vec::new(),
            axes: [0, 1],
            tail: None,
            open: false,
        }
    }

    pub fn clear(&mut self) {
        self.items.clear();
        self.tail = None;
        self.open = false;
    }

    /// Appends; the caller keeps [`RESERVE`].
    pub fn push(&mut self, block: u32, item: Item) -> Result<(), CompensationError> {
        self.items.push(item).map_err(|_| CompensationError {
            block,
            kind: CompensationErrorKind::NotDrained,
        })
    }

    /// Index of the newest live piece.
    pub fn last_live(&self) -> Option<usize> {
        self.items
            .iter()
            .rposition(|item| matches!(item, Item::Piece(piece) if piece.state == State::Live))
    }

    fn live(&self, index: usize) -> Option<&Piece> {
        match self.items.get(index) {
            Some(Item::Piece(piece)) if piece.state == State::Live => Some(piece),
            _ => None,
        }
    }

    /// Takes the next piece of contour; `regular` as told by [`super::offset::Shape::piece`].
    pub fn admit(
        &mut self,
        config: &Config,
        mut piece: Piece,
        regular: bool,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        let shape = piece.shape(config, self.axes);
        let whole = piece.whole();
        let (start, end) = (shape.at(whole[0], whole), shape.at(whole[1], whole));
        let d = signed_radius(&piece.source);
        let joint = match self.tail {
            None => Joint::Tangent,
            Some(tail) => classify(tail.tangent, start.tangent, d),
        };
        match (joint, self.tail) {
            (Joint::Inner(_), Some(Tail { ended: true, .. })) => {
                let kind = CompensationErrorKind::Interrupted {
                    place: place(&piece, start.contour),
                };
                return Err(error(&piece, kind));
            }
            (Joint::Outer(angle), Some(tail)) => {
                let corner = self.position(config, &piece, start.contour)?;
                let tangents = [tail.tangent, start.tangent];
                for part in bridge(config, self.axes, &corner, &piece.source, tangents, angle)
                    .into_iter()
                    .flatten()
                {
                    self.join(config, part, true, meanwhile)?;
                }
            }
            (Joint::Inner(angle), Some(_)) => piece.turn = angle as f32,
            (_, None) => self.resolve(start.centre),
            _ => {}
        }
        self.tail = Some(Tail {
            tangent: end.tangent,
            ended: false,
        });
        if regular {
            self.join(config, piece, !matches!(joint, Joint::Inner(_)), meanwhile)
        } else {
            piece.state = State::Dropped;
            self.open = true;
            self.push(piece.source.block, Item::Piece(piece))
        }
    }

    /// Ends an approach that waits at this point.
    pub fn resolve(&mut self, centre: Point) {
        for item in &mut self.items {
            if let Item::Approach(_, to @ None) = item {
                *to = Some(centre);
            }
        }
    }

    /// Ends an approach that waits at its own normal, as if the contour went straight on.
    pub fn resolve_alone(&mut self, config: &Config, at: &Position) {
        let axes = self.axes;
        let point = |p: &Position| axes.map(|axis| mm(config, axis, p[axis]));
        for item in &mut self.items {
            if let Item::Approach(path, to @ None) = item {
                // The direction of the block; where that is nothing but rounding, of the way there.
                let end = point(&path.segment.end);
                let by = sub(end, point(&path.segment.start));
                let by = if norm(by) > 0.0 {
                    by
                } else {
                    sub(end, point(at))
                };
                let tangent = unit(by);
                *to = Some(add(end, left(tangent), signed_radius(path)));
                self.tail = Some(Tail {
                    tangent,
                    ended: true,
                });
            }
        }
    }

    /// A point of the plane as a position; the other axes as where `piece` begins.
    fn position(
        &self,
        config: &Config,
        piece: &Piece,
        at: Point,
    ) -> Result<Position, CompensationError> {
        let mut out = piece.source.segment.start;
        if piece.part[0] == 0.0 {
            return Ok(out);
        }
        for k in 0..2 {
            let axis = self.axes[k];
            out[axis] = steps(config, axis, at[k])
                .ok_or(error(piece, CompensationErrorKind::OutOfRange))?;
        }
        Ok(out)
    }

    /// Appends a regular piece: where it does not continue the path, cut to where it meets it.
    fn join(
        &mut self,
        config: &Config,
        mut piece: Piece,
        continues: bool,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        let neighbour = !self.open;
        if !(continues && neighbour) {
            let mut met = false;
            for index in (0..self.items.len()).rev() {
                let newest = Some(index) == self.last_live();
                if let Some(crossing) = self.meet(config, index, &piece, CUT, meanwhile) {
                    let neighbours = neighbour && newest;
                    if self.cut(config, index, &mut piece, &crossing, neighbours, meanwhile)? {
                        met = true;
                        break;
                    }
                }
            }
            self.open = !met;
            if !met {
                piece.state = State::Swallowed;
                return self.push(piece.source.block, Item::Piece(piece));
            }
        }
        // A path that crosses itself where the contour is narrower than the tool. What lies between may be a loop of no
        // consequence.
        if let Some(last) = self.last_live() {
            for index in (0..last).rev() {
                let Some(crossing) = self.meet(config, index, &piece, CROSSING, meanwhile) else {
                    continue;
                };
                if !self.cut(config, index, &mut piece, &crossing, false, meanwhile)? {
                    let at = piece.shape(config, self.axes).at(crossing.v, piece.whole());
                    let kind = CompensationErrorKind::Bottleneck {
                        place: place(&piece, at.contour),
                    };
                    return Err(error(&piece, kind));
                }
            }
        }
        self.push(piece.source.block, Item::Piece(piece))
    }

    /// Where `piece` meets the live piece at `index`.
    fn meet(
        &self,
        config: &Config,
        index: usize,
        piece: &Piece,
        least_turn: f64,
        meanwhile: Meanwhile,
    ) -> Option<Crossing> {
        let before = self.live(index)?;
        let apart = (0..2).any(|k| {
            before.bounds[k] > piece.bounds[k + 2] || piece.bounds[k] > before.bounds[k + 2]
        });
        if apart {
            return None;
        }
        let (a, b) = (
            before.shape(config, self.axes),
            piece.shape(config, self.axes),
        );
        let part = |piece: &Piece| (piece.whole(), piece.cut);
        let ((whole_a, range_a), (whole_b, range_b)) = (part(before), part(piece));
        let found = intersect(
            &Part {
                shape: &a,
                whole: whole_a,
                range: range_a,
            },
            &Part {
                shape: &b,
                whole: whole_b,
                range: range_b,
            },
            least_turn,
            meanwhile,
        );
        if found.is_some() || least_turn > CUT {
            return found;
        }
        // Swallowtails smaller than the resolution of the path.
        let gap = norm(sub(
            a.at(range_a[1], whole_a).centre,
            b.at(range_b[0], whole_b).centre,
        ));
        (gap < TOUCH).then_some(Crossing {
            u: range_a[1],
            v: range_b[0],
            cost: gap,
            turn: 0.0,
        })
    }

    /// Cuts the piece at `index` and `piece` back to their crossing and takes out what is between; `false`, and nothing done,
    /// if the tool would cut into the contour between.
    ///
    /// # Errors
    /// More material is left than allowed, and the two are not `neighbours`.
    fn cut(
        &mut self,
        config: &Config,
        index: usize,
        piece: &mut Piece,
        crossing: &Crossing,
        neighbours: bool,
        meanwhile: Meanwhile,
    ) -> Result<bool, CompensationError> {
        let Some(before) = self.live(index) else {
            return Ok(false);
        };
        let radius = signed_radius(&piece.source).abs();
        let shape = piece.shape(config, self.axes);
        let at = shape.at(crossing.v, piece.whole()).centre;
        if !(neighbours && before.straight && piece.straight) {
            let mut ring = Ring::new(at, meanwhile);
            ring.cover(
                config,
                self.axes,
                before,
                [crossing.u, f64::from(before.part[1])],
            );
            ring.cover_whole(config, self.axes, self.items.iter().skip(index + 1));
            ring.cover(
                config,
                self.axes,
                piece,
                [f64::from(piece.part[0]), crossing.v],
            );
            if ring.least < radius - GOUGE {
                return Ok(false);
            }
            let excess = ring.most - radius;
            let allowed =
                f64::from(config.contour_tolerance) + self.inherent(config, index, piece, radius);
            if !neighbours && excess > allowed {
                let left = Place {
                    plane: piece.source.cutter.plane,
                    at: ring.place.map(|v| v as f32),
                };
                let kind = if let Some((radius, _)) = self.tightest(config, index) {
                    CompensationErrorKind::Curvature {
                        radius,
                        place: left,
                    }
                } else if excess > radius {
                    // Room for the tool beyond: a neck, not a niche.
                    let narrow = shape.at(crossing.v, piece.whole()).contour;
                    let place = place(piece, narrow);
                    return Err(error(piece, CompensationErrorKind::Bottleneck { place }));
                } else {
                    CompensationErrorKind::Material {
                        left: excess as f32,
                        place: left,
                    }
                };
                return Err(CompensationError {
                    block: ring.block,
                    kind,
                });
            }
        }
        let mut stop = false;
        let mut from = index + 1;
        while let Some(item) = self.items.get(from) {
            if let Item::Piece(between) = item {
                stop |= between.stop;
                self.items.remove(from);
            } else {
                from += 1;
            }
        }
        if let Some(Item::Piece(before)) = self.items.get_mut(index) {
            before.cut[1] = crossing.u;
            before.stop |= stop;
        }
        piece.cut[0] = crossing.v;
        Ok(true)
    }

    /// The contour ends along `direction`, into its retract, and its end bends tighter than the tool: ends the path where
    /// the tool last is clear of that bend. `false`, and nothing done, if the contour does not end that way, or what is left
    /// of it is longer than [`LEAD`] times the tool's radius.
    ///
    /// A spline with `ETAN` turns into the way home within its last points; the tool leaves the contour there.
    pub fn leave(&mut self, config: &Config, direction: Point, meanwhile: Meanwhile) -> bool {
        let Some(tail) = self.tail else {
            return false;
        };
        if !is_along(tail.tangent, direction) {
            return false;
        }
        let mut length = 0.0;
        for index in (0..self.items.len()).rev() {
            meanwhile();
            let Some(Item::Piece(piece)) = self.items.get(index) else {
                continue;
            };
            let radius = signed_radius(&piece.source).abs();
            if piece.state != State::Live {
                length += self.contour(config, piece, piece.whole());
            } else if length > LEAD * radius {
                return false;
            } else if let Some(u) = self.last_clear(config, index, radius, meanwhile) {
                let rest = [u, f64::from(piece.part[1])];
                if length + self.contour(config, piece, rest) > LEAD * radius {
                    return false;
                }
                let mut stop = false;
                while self.items.len() > index + 1 {
                    if let Some(Item::Piece(between)) = self.items.pop() {
                        stop |= between.stop;
                    }
                }
                if let Some(Item::Piece(piece)) = self.items.get_mut(index) {
                    piece.cut[1] = u;
                    piece.stop |= stop;
                }
                self.open = false;
                return true;
            } else {
                length += self.contour(config, piece, piece.whole());
            }
        }
        false
    }

    /// The contour goes on along its approach and then bends tighter than the tool: begins the path where the tool is clear
    /// of that bend for the first time. `false`, and nothing done, if it does not begin that way, or what is left of it is longer
    /// than [`LEAD`] times the tool's radius.
    ///
    /// A spline with `BTAN` goes on along the approach, wherever its points lie; the counterpart of [`Window::leave`].
    ///
    /// # Errors
    /// What is behind that place cannot be followed.
    pub fn enter(
        &mut self,
        config: &Config,
        meanwhile: Meanwhile,
    ) -> Result<bool, CompensationError> {
        let Some(Item::Approach(path, Some(_))) = self.items.first() else {
            return Ok(false);
        };
        let by = self.axes.map(|axis| {
            mm(config, axis, path.segment.end[axis]) - mm(config, axis, path.segment.start[axis])
        });
        let first = self.items.iter().find_map(|item| match item {
            Item::Piece(piece) => Some(
                piece
                    .shape(config, self.axes)
                    .at(piece.whole()[0], piece.whole()),
            ),
            _ => None,
        });
        if !first.is_some_and(|first| is_along(first.tangent, by)) {
            return Ok(false);
        }
        let mut length = 0.0;
        for index in 1..self.items.len() {
            meanwhile();
            let Some(Item::Piece(piece)) = self.items.get(index) else {
                return Ok(false);
            };
            let radius = signed_radius(&piece.source).abs();
            let whole = piece.whole();
            if length > LEAD * radius {
                return Ok(false);
            }
            let found = match piece.state {
                State::Swallowed => self.first_clear(config, index, radius, meanwhile),
                _ => None,
            };
            let Some(u) = found else {
                length += self.contour(config, piece, whole);
                continue;
            };
            if length + self.contour(config, piece, [whole[0], u]) > LEAD * radius {
                return Ok(false);
            }
            let centre = piece.shape(config, self.axes).at(u, whole).centre;
            let mut behind = core::mem::take(&mut self.items);
            for (k, item) in behind.iter_mut().enumerate() {
                match item {
                    Item::Approach(_, to) => *to = Some(centre),
                    Item::Piece(_) if k < index => continue,
                    Item::Piece(piece) if k == index => {
                        piece.state = State::Live;
                        piece.cut[0] = u;
                        self.open = false;
                    }
                    // Again, now that something before them will be run.
                    Item::Piece(piece) if piece.state == State::Swallowed => {
                        piece.state = State::Live;
                        let continues = piece.turn == 0.0;
                        self.join(config, *piece, continues, meanwhile)?;
                        continue;
                    }
                    Item::Piece(_) => self.open = true,
                    _ => {}
                }
                self.push(path_block(item), *item)?;
            }
            return Ok(true);
        }
        Ok(false)
    }

    /// The first place on the piece at `index` from which the tool is clear of all contour before it.
    fn first_clear(
        &self,
        config: &Config,
        index: usize,
        radius: f64,
        meanwhile: Meanwhile,
    ) -> Option<f64> {
        let Some(Item::Piece(piece)) = self.items.get(index) else {
            return None;
        };
        let (shape, whole) = (piece.shape(config, self.axes), piece.whole());
        let is_clear = |u: f64| {
            let mut ring = Ring::new(shape.at(u, whole).centre, meanwhile);
            ring.cover_whole(config, self.axes, self.items.iter().take(index));
            ring.cover(config, self.axes, piece, [whole[0], u]);
            ring.least >= radius - GOUGE
        };
        first_that(is_clear, whole[0], whole[1])
    }

    /// Length of contour in `range`, by chords.
    fn contour(&self, config: &Config, piece: &Piece, range: [f64; 2]) -> f64 {
        if piece.kind != Kind::Contour {
            return 0.0;
        }
        let (shape, whole) = (piece.shape(config, self.axes), piece.whole());
        let point = |k: u32| {
            let share = f64::from(k) / f64::from(SAMPLES);
            shape
                .at(range[0] + (range[1] - range[0]) * share, whole)
                .contour
        };
        (0..SAMPLES)
            .map(|k| norm(sub(point(k + 1), point(k))))
            .sum()
    }

    /// The last place on the live piece at `index` from which the tool is clear of all contour behind it.
    fn last_clear(
        &self,
        config: &Config,
        index: usize,
        radius: f64,
        meanwhile: Meanwhile,
    ) -> Option<f64> {
        let piece = self.live(index)?;
        let shape = piece.shape(config, self.axes);
        let is_clear = |u: f64| {
            let mut ring = Ring::new(shape.at(u, piece.whole()).centre, meanwhile);
            ring.cover(config, self.axes, piece, [u, f64::from(piece.part[1])]);
            ring.cover_whole(config, self.axes, self.items.iter().skip(index + 1));
            ring.least >= radius - GOUGE
        };
        first_that(is_clear, piece.cut[1], piece.cut[0])
    }

    /// Material that a tool of `radius` leaves in any case between the piece at `index` and `next`: that of the sharpest inner corner among them, programmed, or between points that a spline rounds.
    fn inherent(&self, config: &Config, index: usize, next: &Piece, radius: f64) -> f64 {
        let mut turn = f64::from(next.turn);
        for item in self.items.iter().skip(index + 1) {
            if let Item::Piece(piece) = item {
                turn = turn.max(f64::from(piece.turn));
            }
        }
        let rounded = self.tightest(config, index).is_some_and(|(least, piece)| {
            piece.source.spline && f64::from(least) < ROUNDED * radius
        });
        if rounded {
            // A spline swings past its corner on both sides: how sharp the corner of the points is cannot be told.
            turn = SHARPEST;
        }
        if turn < CORNER_TURN {
            return 0.0;
        }
        // From the corner to the tool that touches both its sides.
        radius * (1.0 / libm::cos(0.5 * turn.min(SHARPEST)) - 1.0)
    }

    /// Smallest radius of curvature among the dropped pieces behind `index`, and where.
    fn tightest(&self, config: &Config, index: usize) -> Option<(f32, &Piece)> {
        let mut out: Option<(f32, &Piece)> = None;
        for item in self.items.iter().skip(index) {
            if let Item::Piece(piece) = item {
                if piece.state == State::Dropped {
                    let shape = piece.shape(config, self.axes);
                    let radius = shape.tightest(piece.whole()) as f32;
                    if out.is_none_or(|(least, _)| radius < least) {
                        out = Some((radius, piece));
                    }
                }
            }
        }
        out
    }

    /// The pieces behind the newest live one have found no way on.
    pub fn blocked(&self, config: &Config) -> CompensationError {
        let from = self.last_live().map_or(0, |index| index + 1);
        if let Some((radius, piece)) = self.tightest(config, from) {
            let whole = piece.whole();
            let at = piece
                .shape(config, self.axes)
                .at(0.5 * (whole[0] + whole[1]), whole);
            let place = place(piece, at.contour);
            return error(piece, CompensationErrorKind::Curvature { radius, place });
        }
        for item in self.items.iter().skip(from) {
            if let Item::Piece(piece) = item {
                let whole = piece.whole();
                let at = piece.shape(config, self.axes).at(whole[0], whole);
                let place = place(piece, at.contour);
                return error(piece, CompensationErrorKind::Bottleneck { place });
            }
        }
        CompensationError {
            block: 0,
            kind: CompensationErrorKind::LookAhead,
        }
    }
}

/// The first of [`SAMPLES`] places on the way from `from` to `to` at which `holds`, moved back towards the place before
/// it as far as it still does.
fn first_that(mut holds: impl FnMut(f64) -> bool, from: f64, to: f64) -> Option<f64> {
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(SAMPLES);
    let k = (0..=SAMPLES).find(|&k| holds(at(k)))?;
    let (mut good, mut bad) = (at(k), at(k.saturating_sub(1)));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if holds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    Some(good)
}

/// Unit tangent `tangent` points along `by`.
fn is_along(tangent: Point, by: Point) -> bool {
    let by = unit(by);
    dot(tangent, by) > 0.0 && cross(tangent, by).abs() < ALONG
}

/// Text line of an item.
fn path_block(item: &Item) -> u32 {
    match item {
        Item::Piece(piece) => piece.source.block,
        Item::Still(path) | Item::Approach(path, _) | Item::Retract(path) | Item::Pass(path) => {
            path.block
        }
        Item::Command(_) => 0,
    }
}

fn error(piece: &Piece, kind: CompensationErrorKind) -> CompensationError {
    CompensationError {
        block: piece.source.block,
        kind,
    }
}

fn place(piece: &Piece, at: Point) -> Place {
    Place {
        plane: piece.source.cutter.plane,
        at: at.map(|v| v as f32),
    }
}

/// Distances of removed contour from the centre of the tool.
struct Ring<'a> {
    centre: Point,
    least: f64,
    most: f64,
    /// Where it is farthest, and whose block that is.
    place: Point,
    block: u32,
    meanwhile: Meanwhile<'a>,
}

impl<'a> Ring<'a> {
    fn new(centre: Point, meanwhile: Meanwhile<'a>) -> Self {
        Self {
            centre,
            least: f64::INFINITY,
            most: 0.0,
            place: [0.0; 2],
            block: 0,
            meanwhile,
        }
    }

    fn point(&mut self, at: Point, block: u32) {
        let distance = norm(sub(at, self.centre));
        self.least = self.least.min(distance);
        // The first of equals: a NaN is not skipped silently but refused as a gouge.
        if !(distance <= self.most) {
            self.most = distance;
            self.place = at;
            self.block = block;
        }
    }

    /// Takes all of the contour of the pieces among `items`.
    fn cover_whole<'b>(
        &mut self,
        config: &Config,
        axes: [usize; 2],
        items: impl Iterator<Item = &'b Item>,
    ) {
        for item in items {
            if let Item::Piece(piece) = item {
                self.cover(config, axes, piece, piece.whole());
            }
        }
    }

    /// Takes a range of the contour of `piece`. Between samples a contour about as round as the ring is off by their
    /// distance squared over 8 r: a micrometre at 24 samples of a range of 24 x 0.1 mm and a radius of 1 mm.
    fn cover(&mut self, config: &Config, axes: [usize; 2], piece: &Piece, range: [f64; 2]) {
        if piece.kind != Kind::Contour {
            // The corner itself is the end of its neighbours.
            return;
        }
        (self.meanwhile)();
        let (shape, whole, block) = (piece.shape(config, axes), piece.whole(), piece.source.block);
        let point = |u: f64| shape.at(u, whole).contour;
        let (start, end) = (point(range[0]), point(range[1]));
        self.point(start, block);
        self.point(end, block);
        let by = sub(end, start);
        if piece.straight {
            // Farthest at an end, nearest at the foot of the perpendicular.
            let foot = dot(sub(self.centre, start), by) / dot(by, by).max(f64::MIN_POSITIVE);
            self.point(add(start, by, foot.clamp(0.0, 1.0)), block);
            return;
        }
        let count = 24;
        for k in 1..count {
            self.point(
                point(range[0] + (range[1] - range[0]) * f64::from(k) / f64::from(count)),
                block,
            );
        }
    }
}
