//! The motion of a block from its words: arcs, spline points, polynomials, and the checks which words may stand
//! beside which interpolation. Comes in a [`Block`] and where it starts, goes out a [`Motion`] part or a [`Fault`].

use super::block::Block;
use super::command::{Arc, Centre, Polynomial, SplineKind, SplineSpec};
use super::error::Fault;
use super::frames::{shifted, Frame};
use super::lexer::letter_bit;
use super::modal::{Lists, Modal, DENOMINATOR};
use super::table::{Group, Mode};
use super::values::{coordinate, refuse};
use crate::catalogue::{nc as message, Message};
use crate::config::{AxisKind, Config, Head};
use crate::units::{Nano, AXES, NANO_PER_UNIT};

/// Weight of a point without `PW`, 1e-4.
const WEIGHT_ONE: u16 = 10_000;
/// Letters that belong to some interpolations only.
const SPECIAL_LETTERS: u32 = letter_bit(b'I')
    | letter_bit(b'J')
    | letter_bit(b'K')
    | letter_bit(b'L')
    | letter_bit(b'P')
    | letter_bit(b'R');
/// Keywords that belong to some interpolations only.
const SPECIAL_GROUPS: u32 = Group::Weight.bit()
    | Group::Interval.bit()
    | Group::Radius.bit()
    | Group::Turns.bit()
    | Group::ToolPoint.bit();

/// True if the line moves: it has coordinates, or is a full circle.
#[inline]
pub(super) fn moves(block: &Block) -> bool {
    block.axes != 0
        || matches!(block.modal.mode, Mode::Arc(_) | Mode::Nurbs)
            && (block.letters & SPECIAL_LETTERS != 0 || block.radius.is_some())
}

/// Refuses words that mean nothing under the interpolation in force; `special` where a function of group 2 reads
/// the words of the line instead.
#[inline]
pub(super) fn check_words(block: &Block, special: bool) -> Result<(), Fault> {
    if block.letters & SPECIAL_LETTERS == 0
        && block.groups & SPECIAL_GROUPS == 0
        && block.polynomial_at.is_none()
    {
        return Ok(());
    }
    check_special_words(block, special)
}

#[cold]
fn check_special_words(block: &Block, special: bool) -> Result<(), Fault> {
    let mode = if !special && moves(block) {
        Some(block.modal.mode)
    } else {
        None
    };
    let arc = matches!(mode, Some(Mode::Arc(_)));
    let spline = matches!(mode, Some(Mode::Spline(_)));
    let polynomial = mode == Some(Mode::Polynomial);
    let nurbs = mode == Some(Mode::Nurbs);
    if block.has(b'L') && !special {
        return Err(Fault::new(block.place(b'L'), 1, &message::HOST_ONLY));
    }
    for (letter, allowed) in [
        (b'P', special || nurbs),
        (b'R', special || nurbs),
        (b'I', arc || mode == Some(Mode::Cubic)),
        (b'J', arc),
        // K words in front of G6 are not its coefficients
        (
            b'K',
            arc || nurbs || mode == Some(Mode::Cubic) && block.k_count != 0,
        ),
    ] {
        if !allowed {
            refuse(block, letter)?;
        }
    }
    for (at, allowed) in [
        (block.weight.map(|word| word.at), spline),
        (block.interval.map(|word| word.at), spline || polynomial),
        (block.radius, arc),
        (
            (block.tool_point != 0).then_some(block.tool_point_at),
            mode == Some(Mode::Spline(SplineKind::BSpline)),
        ),
        (
            block.polynomial_at,
            !special && block.modal.mode == Mode::Polynomial,
        ),
    ] {
        if let (Some(at), false) = (at, allowed) {
            return Err(Fault::new(at, 2, &message::UNEXPECTED_WORD));
        }
    }
    match block.turns {
        Some(turns) if !arc => Err(Fault::new(turns.at, 4, &message::UNEXPECTED_WORD)),
        _ => Ok(()),
    }
}

/// The arc from `start` to `end`.
///
/// # Errors
/// Centre missing, doubly programmed or outside the plane; numbers out of range.
#[cold]
pub(super) fn arc(
    config: &Config,
    block: &Block,
    frame: &Frame,
    start: &[Nano; AXES],
    end: &[Nano; AXES],
    clockwise: bool,
) -> Result<Arc, Fault> {
    let plane = block.modal.plane;
    let inch = block.modal.inch;
    let fault =
        |letter: u8, message: &'static Message| Err(Fault::new(block.place(letter), 1, message));
    // I J K stand as far from X Y Z as the letters do
    let [first, second, normal] = plane.letters().map(|letter| letter - b'X' + b'I');
    let [Some(one), Some(two), _] = config.plane_axes(plane) else {
        return fault(b'G', &crate::catalogue::geometry::ARC_PLANE);
    };
    let turns = block.turns.map_or(0, |turns| turns.value);
    let arc = |centre| Arc {
        plane,
        clockwise,
        centre,
        turns,
    };
    if let Some(at) = block.radius {
        for letter in [first, second, normal] {
            if block.has(letter) {
                return fault(letter, &message::CENTRE_AND_RADIUS);
            }
        }
        if start[one] == end[one] && start[two] == end[two] {
            return Err(Fault::new(at, 2, &message::FULL_CIRCLE_RADIUS));
        }
        return match coordinate(block.r, inch).filter(|radius| *radius != 0) {
            Some(radius) => Ok(arc(Centre::Radius(radius))),
            None => Err(Fault::new(at, 2, &message::OUT_OF_RANGE)),
        };
    }
    if block.has(normal) {
        return fault(normal, &message::CENTRE_OUTSIDE_PLANE);
    }
    if !block.has(first) && !block.has(second) {
        return Err(Fault::new(block.first_axis, 0, &message::MISSING_CENTRE));
    }
    let mut centre = [0; 2];
    for (entry, (letter, axis)) in centre.iter_mut().zip([(first, one), (second, two)]) {
        let index = usize::from(letter - b'I');
        let origin = if block.absolute & (1 << (AXES + index)) != 0 {
            frame.origin(axis)
        } else {
            start[axis]
        };
        if !block.has(letter) {
            *entry = origin;
            continue;
        }
        *entry = match shifted(block.ijk[index], inch, origin) {
            Some(value) => value,
            None => return fault(letter, &message::OUT_OF_RANGE),
        };
    }
    Ok(arc(Centre::Point(centre)))
}

/// Spline state of a block with coordinates.
///
/// # Errors
/// Points of the second curve that are incomplete, or that this machine or this spline cannot have.
#[inline]
pub(super) fn spline(
    config: &Config,
    block: &mut Block,
    frame: &Frame,
    kind: SplineKind,
) -> Result<SplineSpec, Fault> {
    let mut weight = WEIGHT_ONE;
    let mut interval = None;
    let mut tool_point = None;
    if kind == SplineKind::BSpline {
        weight = block.weight.map_or(WEIGHT_ONE, |weight| weight.value);
        interval = block.interval.map(|interval| interval.value.to_f32());
        if block.tool_point != 0 || block.modal.tool_points {
            tool_point = second_curve(config, block, frame)?;
        }
    }
    Ok(SplineSpec {
        interval,
        weight: f32::from(weight) / 1.0e4,
        tool_point,
        ..spec(&block.modal, kind)
    })
}

/// Spline state of a block whose words say nothing about it.
#[inline]
pub(super) fn spec(modal: &Modal, kind: SplineKind) -> SplineSpec {
    SplineSpec {
        kind,
        begin: modal.begin,
        end: modal.end,
        degree: modal.degree,
        interval: None,
        weight: 1.0,
        first: modal.first,
        axes: modal.path,
        tool_point: None,
    }
}

/// `XH YH ZH` of a point of a B-spline.
#[cold]
fn second_curve(
    config: &Config,
    block: &mut Block,
    frame: &Frame,
) -> Result<Option<[Nano; 3]>, Fault> {
    let present = block.tool_point == 0b111;
    let at = if block.tool_point == 0 {
        block.first_axis
    } else {
        block.tool_point_at
    };
    if block.tool_point != 0 && config.head == Head::None {
        return Err(Fault::new(at, 0, &message::NO_HEAD));
    }
    let incomplete = block.tool_point != 0 && !present;
    if incomplete || !block.modal.first && block.modal.tool_points != present {
        return Err(Fault::new(at, 0, &message::TOOL_POINT));
    }
    block.modal.tool_points = present;
    if !present {
        return Ok(None);
    }
    for &axis in block.order.iter().take(block.axes) {
        let Some(axis) = config.axes.get(usize::from(axis)) else {
            continue;
        };
        if axis.kind == AxisKind::Rotary {
            // the second curve turns it
            return refuse(block, axis.letter).map(|()| None);
        }
    }
    let mut point = [0; 3];
    for ((entry, value), letter) in point.iter_mut().zip(block.ijk).zip(*b"XYZ") {
        let axis = config.axes.iter().position(|axis| axis.letter == letter);
        let origin = axis.map_or(0, |axis| frame.origin(axis));
        *entry = shifted(value, block.modal.inch, origin)
            .ok_or_else(|| Fault::new(at, 2, &message::OUT_OF_RANGE))?;
    }
    Ok(Some(point))
}

/// The polynomial of a `POLY` block with coordinates.
///
/// With the programmed origin at `o`, the numerator of `P + o` is that of P and `o` times the denominator, so its
/// coefficients are `a_k + o b_k`.
///
/// # Errors
/// A coefficient that is too large for a number in machine units.
#[cold]
pub(super) fn polynomial(
    config: &Config,
    block: &Block,
    frame: &Frame,
    lists: &Lists,
) -> Result<Polynomial, Fault> {
    let mut denominator = [1.0, 0.0, 0.0, 0.0, 0.0];
    if block.polynomial & DENOMINATOR != 0 {
        denominator = lists.denominator;
    }
    let [_, under @ ..] = denominator;
    let mut finite = denominator.iter().all(|number| number.is_finite());
    let mut coefficients = [[0.0; 4]; AXES];
    for (axis, (row, collected)) in coefficients.iter_mut().zip(&lists.numerators).enumerate() {
        if block.polynomial & (1 << axis) == 0 {
            continue;
        }
        let inch = block.modal.inch && config.axes[axis].kind == AxisKind::Linear;
        let origin = frame.origin(axis) as f64 / NANO_PER_UNIT as f64;
        for ((to, from), under) in row.iter_mut().zip(collected).zip(under) {
            let programmed = if inch { from * 25.4 } else { *from };
            *to = programmed + origin * under;
            finite &= to.is_finite();
        }
    }
    if !finite {
        let at = block.polynomial_at.unwrap_or(block.first_axis);
        return Err(Fault::new(at, 2, &message::OUT_OF_RANGE));
    }
    Ok(Polynomial {
        length: block.interval.map_or(1.0, |length| length.value.to_f64()),
        numerators: block.polynomial & !DENOMINATOR,
        coefficients,
        denominator,
    })
}
