//! What the tool cannot cut without damage is refused by name, with block and place, before it is run.

use super::support::*;
use crate::compensation::CompensationErrorKind as Kind;
use crate::nc::command::{Cutter, Plane, Side};

#[test]
fn a_slot_narrower_than_the_tool_is_refused() {
    // 3 mm wide, 10 mm deep; tool of 4 mm diameter, contour on its right.
    let slot = polyline(
        &[
            [0.0, 0.0],
            [20.0, 0.0],
            [20.0, -10.0],
            [23.0, -10.0],
            [23.0, 0.0],
            [40.0, 0.0],
        ],
        cutter(Side::Left, 2.0),
    );
    let (path, error) = try_contour(&slot);
    let error = error.unwrap();
    assert!(path.is_empty());
    assert!((3..=5).contains(&error.block), "{error}");
    assert!(matches!(error.kind, Kind::Bottleneck { .. }), "{error}");
    assert!(error.to_string().contains(" at X"), "{error}");
    // Just wide enough.
    let mut wide = slot;
    for s in &mut wide {
        s.cutter = cutter(Side::Left, 1.499);
    }
    touches(&wide, &contour(&wide), 1.499, 1);
}

#[test]
fn a_curve_tighter_than_the_tool_is_refused_with_its_radius() {
    let mut round = circle(1.5, 4, cutter(Side::Left, 2.0));
    let lead = line(9, [1.5, -20.0], [1.5, 0.0], round[0].cutter);
    let out = line(10, [-1.5, 0.0], [-1.5, -20.0], round[0].cutter);
    round.truncate(2);
    round.insert(0, lead);
    round.push(out);
    let (path, error) = try_contour(&round);
    let error = error.unwrap();
    assert!(path.is_empty());
    match error.kind {
        Kind::Curvature { radius, .. } => assert!((radius - 1.5).abs() < 0.02, "{error}"),
        _ => panic!("{error}"),
    }
    assert!(error.block <= 2, "{error}");
    assert_eq!(error.code(), 170);
}

#[test]
fn a_neck_behind_which_the_contour_widens_is_refused() {
    // A keyhole: 3 mm wide neck, 20 mm wide room.
    let key = polyline(
        &[
            [0.0, 0.0],
            [20.0, 0.0],
            [20.0, -10.0],
            [12.0, -10.0],
            [12.0, -25.0],
            [31.0, -25.0],
            [31.0, -10.0],
            [23.0, -10.0],
            [23.0, 0.0],
            [40.0, 0.0],
        ],
        cutter(Side::Left, 2.0),
    );
    let (path, error) = try_contour(&key);
    let error = error.unwrap();
    assert!(path.is_empty(), "{error}");
    assert!(matches!(error.kind, Kind::Bottleneck { .. }), "{error}");
    assert!(error.block >= 8, "{error}");
}

#[test]
fn a_block_too_short_between_inner_corners_is_refused() {
    let chamfer = polyline(
        &[[0.0, 0.0], [20.0, 0.0], [20.5, 0.5], [20.5, 20.0]],
        cutter(Side::Left, 5.0),
    );
    let (path, error) = try_contour(&chamfer);
    let error = error.unwrap();
    assert!(path.is_empty());
    assert!(
        matches!(error.kind, Kind::Material { left, .. } if left > 0.05),
        "{error}"
    );
}

#[test]
fn radius_and_plane_stay_while_compensation_is_on() {
    let g41 = cutter(Side::Left, 2.0);
    let mut other = g41;
    other.radius += 1;
    let mut plane = g41;
    plane.plane = Plane::Zx;
    for (changed, code) in [(other, 202), (plane, 202)] {
        let mut path = polyline(&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]], g41);
        path[1].cutter = changed;
        let (_, error) = try_contour(&path);
        let error = error.unwrap();
        assert_eq!((error.code(), error.block), (code, 2));
    }
}

#[test]
fn approach_and_retract_must_be_straight() {
    let g41 = cutter(Side::Left, 2.0);
    let bend = |c: Cutter| curve(2, [10.0, 0.0], [20.0, 0.0], [10.0, 9.0], [10.0, -9.0], c);
    let (_, error) = try_contour(&[line(1, [0.0, 0.0], [10.0, 0.0], g41), bend(Cutter::OFF)]);
    assert_eq!(error.unwrap().code(), 176);
    let inputs = [Input::Segment(bend(g41))];
    let (_, error) = run_all(&config(), at([10.0, 0.0]), &inputs);
    assert_eq!(error.unwrap().code(), 176);
}

#[test]
fn too_many_blocks_beside_the_plane_are_refused() {
    let g41 = cutter(Side::Left, 2.0);
    let mut path = vec![line(1, [0.0, 0.0], [10.0, 0.0], g41)];
    for k in 0..20 {
        let z = |k: u32| [10.0, 0.0, f64::from(k), 0.0, 0.0];
        path.push(line5(k + 2, z(k), z(k + 1), g41));
    }
    let (_, error) = try_contour(&path);
    assert_eq!(error.unwrap().code(), 177);
}

#[test]
fn every_error_has_reason_and_mend() {
    for entry in crate::catalogue::entries().filter(|e| (170..190).contains(&e.message.code)) {
        assert!(
            !entry.reason.is_empty() && !entry.mend.is_empty(),
            "{}",
            entry.message.code
        );
    }
}
