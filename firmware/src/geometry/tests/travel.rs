//! Travel of blocks that make many segments: nothing of a block is handed out unless all of it is inside. The oracle is
//! the same path on a machine without ends, sampled.

use super::rational::Nurbs;
use super::support::*;
use crate::config::Config;
use crate::geometry::travel::TravelBounds;
use crate::geometry::{GeometryError, GeometryErrorKind, PathSegment, SegmentBuilder};
use crate::nc::command::{Arc, Centre, Cutter, Motion, Move, Plane, Polynomial, Side};
use crate::units::{Nano, AXES, NANO_PER_UNIT};
use proptest::prelude::*;

/// Samples per segment.
const SAMPLES: u32 = 64;

/// Ends of travel, mm or degree.
type Travel = [[f64; 2]; AXES];

fn between(travel: &Travel) -> Config {
    let mut config = config();
    for (axis, [low, high]) in config.axes.iter_mut().zip(travel) {
        axis.travel_min = (low * 1e6).round() as Nano;
        axis.travel_max = (high * 1e6).round() as Nano;
    }
    config
}

/// What is handed out up to the end or the first error.
fn try_out(
    config: &Config,
    start: &Point,
    blocks: &[Move],
) -> (Vec<PathSegment>, Option<GeometryError>) {
    let mut builder = SegmentBuilder::new(config, steps(config, start));
    let mut out = Vec::new();
    for block in blocks {
        loop {
            let result = builder.push(config, block);
            out.extend(core::iter::from_fn(|| builder.next(config)));
            match result {
                Err(error) if error.kind == GeometryErrorKind::NotDrained => {}
                Err(error) => return (out, Some(error)),
                Ok(()) => break,
            }
        }
    }
    while builder.is_open() {
        let result = builder.finish(config);
        out.extend(core::iter::from_fn(|| builder.next(config)));
        if let Err(error) = result {
            return (out, Some(error));
        }
    }
    (out, None)
}

/// By how much the path of line `block` leaves the travel (negative: what is left), mm or degree, over all axes.
fn excess(travel: &Travel, path: &[PathSegment], block: u32) -> f64 {
    let mut most = f64::NEG_INFINITY;
    for path in path.iter().filter(|path| path.block == block) {
        for k in 0..=SAMPLES {
            let at = evaluate(&path.segment, f64::from(k) / f64::from(SAMPLES))[0];
            for (at, [low, high]) in at.iter().zip(travel) {
                most = most.max(at - high).max(low - at);
            }
        }
    }
    most
}

/// Law: a block within travel is driven, and the machine has nothing to object to; of one that is not, and of those behind
/// it, nothing is handed out. Within `grain` either is good.
fn begins_only_what_it_can_end(
    travel: &Travel,
    start: &Point,
    blocks: &[Move],
    grain: f64,
) -> Result<(), TestCaseError> {
    let (free, error) = try_out(&config(), start, blocks);
    prop_assume!(error.is_none());
    let config = between(travel);
    let (path, error) = try_out(&config, start, blocks);
    let bounds = TravelBounds::new(&config);
    for path in &path {
        prop_assert_eq!(bounds.outside(&config, &path.segment), None);
    }
    let last = blocks.last().map_or(0, |block| block.block);
    for block in 1..=last {
        let by = excess(travel, &free, block);
        match error {
            Some(error) if error.block == block => {
                let is_travel = matches!(error.kind, GeometryErrorKind::Travel { .. });
                prop_assert!(is_travel, "{error}");
                prop_assert!(by > -grain, "line {block} has {by} left");
                prop_assert!(path.iter().all(|path| path.block < block));
                return Ok(());
            }
            _ => prop_assert!(by < grain, "line {block} is {by} outside"),
        }
    }
    prop_assert_eq!(path, free);
    Ok(())
}

/// Travel that holds the start and reaches random parts of the size of the curves.
fn travel() -> impl Strategy<Value = Travel> {
    prop::array::uniform5(prop::array::uniform2(0.0..60.0_f64))
        .prop_map(|room| room.map(|[low, high]| [-low - 1.0, high + 1.0]))
}

proptest! {
    #[test]
    fn arcs_begin_only_within_travel(
        travel in travel(),
        radius in 1.0..50.0_f64,
        from in -3.2..3.2_f64,
        sweep in 0.05..6.2_f64,
        clockwise: bool,
        turns in 0u16..3,
        growth in -0.009..0.009_f64,
        along in -40.0..40.0_f64,
        plane in 0usize..3,
    ) {
        let (plane, [a, b, c]) = [
            (Plane::Xy, [0, 1, 2]),
            (Plane::Zx, [2, 0, 1]),
            (Plane::Yz, [1, 2, 0]),
        ][plane];
        // the path starts in the origin
        let centre = [-radius * from.cos(), -radius * from.sin()];
        let to = if clockwise { from - sweep } else { from + sweep };
        let mut end = [0.0; AXES];
        end[a] = centre[0] + (radius + growth) * to.cos();
        end[b] = centre[1] + (radius + growth) * to.sin();
        end[c] = along;
        let nano = centre.map(|x| (x * NANO_PER_UNIT as f64).round() as Nano);
        let arc = Motion::Arc(Arc { plane, clockwise, centre: Centre::Point(nano), turns });
        // a sixtyfourth of a segment away from the extreme
        begins_only_what_it_can_end(&travel, &[0.0; AXES], &[block(1, arc, &end)], 2e-3)?;
    }

    #[test]
    fn polynomials_begin_only_within_travel(
        travel in travel(),
        k in prop::array::uniform5(prop::array::uniform4(-60.0..60.0_f64)),
        b in prop::array::uniform4(0.0..0.5_f64),
        at_end in 0.3..3.0_f64,
        numerators: u8,
        size in 0.05..1.0_f64,
        end in prop::array::uniform5(-40.0..40.0_f64),
    ) {
        let curve = Polynomial {
            length: 1.0,
            numerators,
            coefficients: k.map(|k| k.map(|k| k * size)),
            denominator: [at_end, b[0], b[1], b[2], b[3]],
        };
        let end = end.map(|x| x * size);
        let blocks = [block(1, Motion::Polynomial(curve), &end)];
        begins_only_what_it_can_end(&travel, &[0.0; AXES], &blocks, 2e-3)?;
    }

    #[test]
    fn rational_splines_begin_no_span_that_leaves_the_travel(
        travel in travel(),
        degree in 1u8..=3,
        points in prop::collection::vec(prop::array::uniform5(-60.0..60.0_f64), 4..9),
        weights in prop::collection::vec(0.1..3.0_f32, 9),
        size in 0.05..1.0_f64,
        linear in 0u8..32,
    ) {
        let mut points: Vec<Point> = points.iter().map(|p| p.map(|x| x * size)).collect();
        points[0] = [0.0; AXES];
        let mut nurbs = Nurbs::new(degree, &points).weights(&weights[..points.len()]);
        nurbs.axes = !linear;
        // Spans of equal weights are one cubic; the machine looks at that.
        prop_assume!(linear != 0 || degree > 1);
        begins_only_what_it_can_end(&travel, &points[0], &nurbs.blocks(), 2e-3)?;
    }
}

/// X from -500 to 500, as on the machine of the examples.
fn half_a_metre() -> Config {
    let mut travel = [[-1000.0, 1000.0]; AXES];
    travel[0] = [-500.0, 500.0];
    between(&travel)
}

fn full_circle(radius: f64) -> Move {
    let arc = Motion::Arc(Arc {
        plane: Plane::Xy,
        clockwise: true,
        centre: Centre::Point([(radius * 1e6).round() as Nano, 0]),
        turns: 0,
    });
    block(1, arc, &[0.0; AXES])
}

#[test]
fn a_circle_may_touch_the_end_of_travel_but_not_by_a_micrometre_cross_it() {
    let config = half_a_metre();
    for radius in [250.0, 1.0, 249.999_999] {
        let (path, error) = try_out(&config, &[0.0; AXES], &[full_circle(radius)]);
        assert!(error.is_none() && path.len() > 1, "{radius} {error:?}");
    }
    // starts of any kind, with the right end on 500
    for k in 0..200 {
        let x = -499.9 + 4.7 * f64::from(k);
        let radius = (500.0 - x) / 2.0;
        let start = [x, 0.0, 0.0, 0.0, 0.0];
        let arc = Motion::Arc(Arc {
            plane: Plane::Xy,
            clockwise: k % 2 == 0,
            centre: Centre::Point([((x + radius) * 1e6).round() as Nano, 0]),
            turns: 0,
        });
        let (path, error) = try_out(&config, &start, &[block(1, arc, &start)]);
        assert!(error.is_none(), "{x} {error:?}");
        let bounds = TravelBounds::new(&config);
        let good = |path: &PathSegment| bounds.outside(&config, &path.segment).is_none();
        assert!(path.iter().all(good), "{x}");
    }
    for radius in [250.001, 300.0, -250.001] {
        let (path, error) = try_out(&config, &[0.0; AXES], &[full_circle(radius)]);
        assert_eq!(path, [], "{radius}");
        let error = error.unwrap();
        assert_eq!(error.kind, GeometryErrorKind::Travel { axis: 0 });
        assert_eq!(
            (error.code(), error.kind.with_letters(&config).to_string()),
            (
                201,
                "axis X leaves its travel on the way to this point".to_owned()
            )
        );
    }
}

#[test]
fn an_open_spline_before_a_bad_circle_stands_as_it_was() {
    let config = half_a_metre();
    let mut builder = SegmentBuilder::new(&config, steps(&config, &[0.0; AXES]));
    let natural = crate::nc::command::BoundaryCondition::Natural;
    let spline = spec(crate::nc::command::SplineKind::Cubic, natural, natural);
    for (number, x) in [(1, 5.0), (2, 11.0)] {
        let point = [x, x * x / 40.0, 0.0, 0.0, 0.0];
        let block = block(number, Motion::Spline(spline), &point);
        builder.push(&config, &block).unwrap();
    }
    // from (11, 3.025) about a point 300 away
    let at = [11.0, 3.025, 0.0, 0.0, 0.0];
    let arc = Motion::Arc(Arc {
        plane: Plane::Xy,
        clockwise: false,
        centre: Centre::Point([311_000_000, 3_025_000]),
        turns: 0,
    });
    let error = builder.push(&config, &block(3, arc, &at)).unwrap_err();
    assert_eq!(error.kind, GeometryErrorKind::Travel { axis: 0 });
    builder.finish(&config).unwrap();
    let path: Vec<_> = core::iter::from_fn(|| builder.next(&config)).collect();
    assert_eq!(path.iter().map(|p| p.block).collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn under_compensation_the_contour_is_not_the_path() {
    let mut circle = full_circle(250.5);
    circle.cutter = Cutter {
        side: Side::Right,
        radius: 1_000_000,
        ..Cutter::OFF
    };
    let (path, error) = try_out(&half_a_metre(), &[0.0; AXES], &[circle]);
    assert!(error.is_none() && path.len() > 1);
}

#[test]
fn a_denominator_that_dips_on_the_way_is_seen() {
    // t / (1 - 3 t + 3 t^2) ends on 1, and is 2.15 at t = 0.577
    let mut travel = [[-5.0, 5.0]; AXES];
    let curve = Motion::Polynomial(Polynomial {
        length: 1.0,
        numerators: 0b1,
        coefficients: [[0.0; 4]; AXES],
        denominator: [1.0, 3.0, 0.0, 0.0, 0.0],
    });
    let blocks = [block(1, curve, &[1.0, 0.0, 0.0, 0.0, 0.0])];
    for (end, good) in [(2.16, true), (2.15, false), (1.5, false)] {
        travel[0][1] = end;
        let (path, error) = try_out(&between(&travel), &[0.0; AXES], &blocks);
        assert_eq!((error.is_none(), !path.is_empty()), (good, good), "{end}");
    }
}
