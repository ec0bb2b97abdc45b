//! A-splines.

use super::oracle::{self, End};
use super::support::*;
use crate::geometry::SegmentBuilder;
use crate::nc::command::{BoundaryCondition, Motion, SplineKind};
use crate::units::AXES;
use proptest::prelude::*;

fn conditions() -> impl Strategy<Value = (BoundaryCondition, End)> {
    prop_oneof![
        Just((BoundaryCondition::NotAKnot, End::NotAKnot)),
        Just((BoundaryCondition::Natural, End::Natural)),
        // Nothing before and nothing behind it: natural.
        Just((BoundaryCondition::Tangent, End::Natural)),
    ]
}

proptest! {
    #[test]
    fn a_spline_is_akimas(points in points(1..40), begin in conditions(), end in conditions()) {
        let auto = BoundaryCondition::NotAKnot;
        prop_assume!(points.len() > 2 || (begin.0 != auto && end.0 != auto));
        let segments = spline(&points, spec(SplineKind::Akima, begin.0, end.0));
        joins_exactly(&steps(&config(), &points[0]), &segments);
        let ends: Vec<_> = segments
            .chunk_by(|a, b| a.block == b.block)
            .map(|of_block| of_block[of_block.len() - 1])
            .collect();
        hits_knots(&points, &ends);
        let h = oracle::chords(&points);
        let want: Vec<oracle::Pieces> = (0..AXES)
            .map(|axis| {
                let y: Vec<f64> = points.iter().map(|point| point[axis]).collect();
                oracle::akima(&h, &y, begin.1, end.1)
            })
            .collect();
        for (k, path) in ends.iter().enumerate() {
            // A knot between rotary-only and linear-only motion may have no slope at all; see `singular`.
            let rests = [0.0, 1.0].iter().any(|u| {
                let slope = core::array::from_fn(|axis| oracle::slope(&want[axis][k], *u));
                norm(&slope) < 1e-3
            });
            for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let at = core::array::from_fn(|axis| oracle::value(&want[axis][k], u));
                let error = distance(&evaluate(&path.segment, u)[0], &at);
                prop_assert!(rests || error < 3e-6 * scale(&path.segment), "{}: {error}", path.block);
            }
        }
    }

    #[test]
    fn neighbours_share_a_tangent(points in flowing_points(3..40)) {
        let auto = BoundaryCondition::NotAKnot;
        is_tangent_continuous(&spline(&points, spec(SplineKind::Akima, auto, auto)), 1e-6);
    }
}

#[test]
fn a_segment_is_out_two_knots_after_its_end() {
    let config = config();
    let auto = BoundaryCondition::NotAKnot;
    let motion = Motion::Spline(spec(SplineKind::Akima, auto, auto));
    let mut builder = SegmentBuilder::new(&config, steps(&config, &[0.0; AXES]));
    for knot in 1..50_u32 {
        let x = f64::from(knot);
        let at = [x, (x * 0.7).sin(), 0.0, 0.0, 0.0];
        builder.push(&config, &block(knot, motion, &at)).unwrap();
        let segment = builder.next(&config);
        assert_eq!(
            segment.map(|path| path.block),
            knot.checked_sub(2).filter(|k| *k > 0)
        );
        assert!(builder.next(&config).is_none());
    }
}
