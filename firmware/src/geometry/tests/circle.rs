//! Circles against `sin` and `cos` in `f64`.

use super::support::*;
use crate::config::Config;
use crate::geometry::{GeometryErrorKind, PathSegment, SegmentBuilder};
use crate::nc::command::{Arc, Centre, Motion, Plane};
use crate::units::AXES;
use core::f64::consts::{PI, TAU};

const PLANES: [(Plane, [usize; 2]); 3] = [
    (Plane::Xy, [0, 1]),
    (Plane::Zx, [2, 0]),
    (Plane::Yz, [1, 2]),
];

/// Largest distance from the true curve, mm.
const TOLERANCE: f64 = 5.0e-5;

fn arc(plane: Plane, clockwise: bool, centre: Centre, turns: u16) -> Motion {
    Motion::Arc(Arc {
        plane,
        clockwise,
        centre,
        turns,
    })
}

/// Law: `path` is the arc about `centre` that turns by `angle`, other axes going linearly with the angle.
///
/// Angles are unwound along the way, so the sense and the number of turns count, too.
fn is_arc(axes: [usize; 2], centre: [f64; 2], angle: f64, path: &[PathSegment]) {
    let first = evaluate(&path[0].segment, 0.0)[0];
    let last = evaluate(&path[path.len() - 1].segment, 1.0)[0];
    let polar = |at: &Point| {
        let by = [at[axes[0]] - centre[0], at[axes[1]] - centre[1]];
        (by[0].hypot(by[1]), by[1].atan2(by[0]))
    };
    let (radius, start) = polar(&first);
    let (radius_end, _) = polar(&last);
    let mut turned = 0.0_f64;
    for path in path {
        for k in 1..=16 {
            let at = evaluate(&path.segment, f64::from(k) / 16.0)[0];
            let (r, now) = polar(&at);
            let step = (now - start - turned + PI).rem_euclid(TAU) - PI;
            turned += step;
            let share = turned / angle;
            let want = radius + share * (radius_end - radius);
            assert!((r - want).abs() < TOLERANCE, "radius {r} for {want}");
            for axis in (0..AXES).filter(|axis| !axes.contains(axis)) {
                let want = first[axis] + share * (last[axis] - first[axis]);
                // Where the radius is small, so is the accuracy of the angle.
                let slack = TOLERANCE + 1e-9 / radius;
                assert!(
                    (at[axis] - want).abs() < slack,
                    "axis {axis}: {}",
                    at[axis] - want
                );
            }
        }
    }
    assert!(
        (turned - angle).abs() < 1e-9 + 1e-8 / radius,
        "{turned} for {angle}"
    );
}

/// A point on a circle; rounded to the resolution of programs.
fn on(axes: [usize; 2], centre: [f64; 2], radius: f64, angle: f64) -> Point {
    let mut at = [0.0; AXES];
    at[axes[0]] = centre[0] + radius * angle.cos();
    at[axes[1]] = centre[1] + radius * angle.sin();
    at.map(|value| (value * 1e6).round() / 1e6)
}

fn nano2(at: [f64; 2]) -> Centre {
    Centre::Point(at.map(|value| (value * 1e6).round() as i64))
}

/// Runs one arc. The test machine reaches further than 1e5 mm.
fn run_arc(
    start: &Point,
    motion: Motion,
    end: &Point,
) -> Result<Vec<PathSegment>, GeometryErrorKind> {
    run(start, &[block(1, motion, end)]).map_err(|error| error.kind)
}

#[test]
fn arcs_of_any_radius_plane_and_sense_stay_on_their_circle() {
    for exponent in -3..=5 {
        let radius = 10_f64.powi(exponent) * 1.25;
        for (plane, axes) in PLANES {
            for (from, by) in [
                (0.3, 0.001),
                (1.0, 0.9),
                (-2.0, 3.1),
                (3.0, 5.0),
                (0.1, 6.27),
            ] {
                // Shorter than the resolution of programs: a full turn, by definition.
                if radius * by < 1e-4 {
                    continue;
                }
                for clockwise in [false, true] {
                    let by = if clockwise { -by } else { by };
                    let centre = [3.0, -7.0];
                    let mut start = on(axes, centre, radius, from);
                    let mut end = on(axes, centre, radius, from + by);
                    start[4] = 10.0;
                    end[4] = 14.0;
                    let path =
                        run_arc(&start, arc(plane, clockwise, nano2(centre), 0), &end).unwrap();
                    joins_exactly(&steps(&config(), &start), &path);
                    assert_eq!(path[path.len() - 1].segment.end, steps(&config(), &end));
                    let exact =
                        |at: &Point| (at[axes[1]] - centre[1]).atan2(at[axes[0]] - centre[0]);
                    let full = if clockwise { -TAU } else { TAU };
                    let mut angle = exact(&end) - exact(&start);
                    if angle * full < 0.0 {
                        angle += full;
                    }
                    if angle.abs() > TAU {
                        angle -= full;
                    }
                    is_arc(axes, centre, angle, &path);
                    is_tangent_continuous(&path, 2e-6);
                }
            }
        }
    }
}

#[test]
fn a_circle_of_one_metre_takes_few_segments() {
    let start = [1000.0, 0.0, 0.0, 0.0, 0.0];
    let path = run_arc(
        &start,
        arc(Plane::Xy, false, Centre::Point([0, 0]), 0),
        &start,
    )
    .unwrap();
    assert!(path.len() < 30, "{}", path.len());
    is_arc([0, 1], [0.0, 0.0], TAU, &path);
}

#[test]
fn helices_turn_as_often_as_they_are_told() {
    for (clockwise, turns, full) in [
        (false, 0, false),
        (true, 3, false),
        (false, 7, true),
        (true, 40, true),
    ] {
        let sign = if clockwise { -1.0 } else { 1.0 };
        let start = [15.0, 5.0, 1.0, 0.0, 0.0];
        let (mut end, part) = if full {
            (start, TAU)
        } else {
            // A quarter about (5, 5), or three.
            (
                [5.0, 15.0, 0.0, 0.0, 0.0],
                if clockwise { 1.5 * PI } else { 0.5 * PI },
            )
        };
        end[2] = -80.0;
        end[3] = 30.0;
        let motion = arc(
            Plane::Xy,
            clockwise,
            Centre::Point([5_000_000, 5_000_000]),
            turns,
        );
        let path = run_arc(&start, motion, &end).unwrap();
        is_arc(
            [0, 1],
            [5.0, 5.0],
            sign * (part + f64::from(turns) * TAU),
            &path,
        );
        assert_eq!(path[path.len() - 1].segment.end, steps(&config(), &end));
    }
}

#[test]
fn a_radius_finds_the_smaller_arc_and_a_negative_one_the_larger() {
    let (start, end) = ([10.0, 0.0, 0.0, 0.0, 0.0], [0.0, 10.0, 0.0, 0.0, 0.0]);
    for (clockwise, radius, centre, angle) in [
        (false, 10_000_000, [0.0, 0.0], 0.5 * PI),
        (true, -10_000_000, [0.0, 0.0], -1.5 * PI),
        (true, 10_000_000, [10.0, 10.0], -0.5 * PI),
        (false, -10_000_000, [10.0, 10.0], 1.5 * PI),
    ] {
        let path = run_arc(
            &start,
            arc(Plane::Xy, clockwise, Centre::Radius(radius), 0),
            &end,
        )
        .unwrap();
        is_arc([0, 1], centre, angle, &path);
    }
}

#[test]
fn a_flat_arc_by_radius_is_exact_as_well() {
    // 1 mm of a circle of 100 m, at the end of the envelope.
    let (start, end) = ([400.0, 300.0, 0.0, 0.0, 0.0], [401.0, 300.0, 0.0, 0.0, 0.0]);
    let path = run_arc(
        &start,
        arc(Plane::Xy, false, Centre::Radius(100_000_000_000), 0),
        &end,
    )
    .unwrap();
    let height = (1e10_f64 - 0.25).sqrt();
    is_arc(
        [0, 1],
        [400.5, 300.0 + height],
        2.0 * (0.5_f64 / 1e5).asin(),
        &path,
    );
    // Its sagitta is 1/8 of a micrometre of c^2 / 8 r = 1.25e-6 mm: below the chord.
    let middle = evaluate(&path[path.len() / 2].segment, 0.0)[0];
    assert!(middle[1] <= 300.0 && middle[1] > 299.999_99);
}

#[test]
fn a_radius_that_misses_a_little_is_mended_and_more_is_refused() {
    let config = config();
    let (start, end) = ([0.0; AXES], [20.0, 0.0, 0.0, 0.0, 0.0]);
    // Half the chord is 10 mm, the tolerance 0.01 mm.
    let path = run_arc(
        &start,
        arc(Plane::Xy, false, Centre::Radius(9_991_000), 0),
        &end,
    )
    .unwrap();
    is_arc([0, 1], [10.0, 0.0], PI, &path);
    assert_eq!(
        run_arc(
            &start,
            arc(Plane::Xy, false, Centre::Radius(9_989_000), 0),
            &end
        ),
        Err(GeometryErrorKind::ArcReach {
            radius: 9_989_000,
            half: 10_000_000
        })
    );
    // Radii of 10 and 10.009 mm: a spiral; 10 and 10.011: an error with both.
    let spiral = arc(Plane::Xy, false, Centre::Point([10_000_000, 0]), 0);
    let path = run_arc(&start, spiral, &[20.009, 0.0, 0.0, 0.0, 0.0]).unwrap();
    is_arc([0, 1], [10.0, 0.0], PI, &path);
    assert_eq!(
        run_arc(&start, spiral, &[20.011, 0.0, 0.0, 0.0, 0.0]),
        Err(GeometryErrorKind::ArcRadii {
            start: 10_000_000,
            end: 10_011_000
        })
    );
    assert!(config.arc_tolerance == 0.01);
}

#[test]
fn arcs_without_a_circle_are_refused_by_name() {
    let at = [1.0, 2.0, 3.0, 4.0, 5.0];
    let elsewhere = [1.0, 2.001, 3.0, 4.0, 5.0];
    let refused =
        |centre, end: &Point| run_arc(&at, arc(Plane::Xy, true, centre, 0), end).unwrap_err();
    assert_eq!(
        refused(Centre::Radius(1_000_000), &at),
        GeometryErrorKind::ArcNoChord
    );
    assert_eq!(
        refused(Centre::Radius(0), &elsewhere),
        GeometryErrorKind::ArcNoRadius
    );
    assert_eq!(
        refused(Centre::Point([1_000_000, 2_000_000]), &at),
        GeometryErrorKind::ArcNoRadius
    );
    // Both ends within the tolerance, but the centre on one of them.
    assert_eq!(
        refused(Centre::Point([1_000_000, 2_000_000]), &elsewhere),
        GeometryErrorKind::ArcNoRadius
    );
    assert_eq!(
        refused(Centre::Point([1_000_000, 2_001_000]), &elsewhere),
        GeometryErrorKind::ArcNoRadius
    );
    for radius in [i64::MAX, i64::MIN, 3_000_000_000_000] {
        let kind = refused(Centre::Radius(radius), &elsewhere);
        assert!(
            matches!(kind, GeometryErrorKind::OutOfRange { axis: 0 | 1 }),
            "{kind:?}"
        );
    }
    assert_eq!(
        refused(Centre::Point([i64::MAX, 0]), &elsewhere),
        GeometryErrorKind::OutOfRange { axis: 0 }
    );
}

#[test]
fn a_plane_needs_its_axes() {
    let mut config: Config = config();
    config.axes[1].letter = b'V';
    let mut builder = SegmentBuilder::new(&config, steps(&config, &[0.0; AXES]));
    let motion = arc(Plane::Xy, true, Centre::Point([1_000_000, 0]), 0);
    let error = builder
        .push(&config, &block(1, motion, &[2.0, 0.0, 0.0, 0.0, 0.0]))
        .unwrap_err();
    assert_eq!(error.kind, GeometryErrorKind::ArcPlane { letter: b'Y' });
    assert_eq!(
        error.kind.to_string(),
        "the machine lacks an axis of the plane of the arc"
    );
}

#[test]
fn the_segments_of_a_large_circle_are_cut_as_they_are_asked_for() {
    let config = config();
    let start = [10.0, 0.0, 0.0, 0.0, 0.0];
    let mut builder = SegmentBuilder::new(&config, steps(&config, &start));
    let mut block = block(1, arc(Plane::Xy, false, Centre::Point([0, 0]), 999), &start);
    block.exact_stop = true;
    builder.push(&config, &block).unwrap();
    assert!(builder.is_open());
    let path: Vec<_> = core::iter::from_fn(|| builder.next(&config)).collect();
    assert!(!builder.is_open());
    assert!(path.len() > 4000);
    is_arc([0, 1], [0.0, 0.0], 1000.0 * TAU, &path);
    // Only the last one stops.
    assert_eq!(path.iter().filter(|path| path.exact_stop).count(), 1);
    assert!(path[path.len() - 1].exact_stop);
}

/// Whatever is sent: refused by name, or on the ring between the two radii, from start to end.
#[test]
fn hostile_arcs_never_leave_their_ring() {
    let mut seed = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = move |span: i64| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 2) as i64 % span.max(1)
    };
    let mut accepted = 0;
    for _ in 0..20_000 {
        // Sizes from nanometres to hundreds of metres.
        let size = 10_i64.pow(random(12) as u32) + 1;
        let mut number = || (random(2 * size) - size) as f64 / 1e6;
        let start = [number(), number(), 0.0, 0.0, 0.0];
        let mut end = [number(), number(), 0.0, 0.0, 0.0];
        let centre = [number(), number()];
        let (clockwise, by_radius, nearly) = (random(2) == 0, random(2) == 0, random(4) == 0);
        let radius = random(2 * size) - size;
        if nearly {
            // Two ends that all but meet.
            end = start;
            end[random(2) as usize] += random(3) as f64 / 1e6;
        } else if !by_radius {
            let by = (start[0] - centre[0]).hypot(start[1] - centre[1]);
            end = on([0, 1], centre, by, random(1000) as f64);
        }
        let centre_of = if by_radius {
            Centre::Radius(radius)
        } else {
            nano2(centre)
        };
        let Ok(path) = run_arc(&start, arc(Plane::Xy, clockwise, centre_of, 0), &end) else {
            continue;
        };
        accepted += 1;
        joins_exactly(&steps(&config(), &start), &path);
        assert_eq!(path[path.len() - 1].segment.end, steps(&config(), &end));
        let reach = if by_radius {
            // The far side of the circle is a diameter away.
            2.0 * (radius.abs() as f64 / 1e6) + 0.03
        } else {
            2.0 * (start[0] - centre[0]).hypot(start[1] - centre[1]) + 0.03
        };
        for path in &path {
            for u in [0.0, 0.3, 0.7] {
                let at = evaluate(&path.segment, u)[0];
                assert!(at.iter().all(|value| value.is_finite()));
                assert!(distance(&at, &start) <= reach, "{at:?} from {start:?}");
                if !by_radius {
                    let (r, want) = (
                        (at[0] - centre[0]).hypot(at[1] - centre[1]),
                        (start[0] - centre[0]).hypot(start[1] - centre[1]),
                    );
                    assert!((r - want).abs() < 0.01 + 1e-4, "{r} for {want}");
                }
            }
        }
    }
    assert!(accepted > 4000, "{accepted}");
}
