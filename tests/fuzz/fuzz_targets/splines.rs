//! Random blocks straight to the geometry stage: no panic, finite segments that join exactly, and no curve that passes
//! the travel check outside travel.
#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use pentaspline::config::Dialect;
use pentaspline::geometry::SegmentBuilder;
use pentaspline::nc::command::{
    Arc, BoundaryCondition, Centre, CubicBlock, Cutter, FeedType, Motion, Move, Plane, Polynomial,
    SplineKind, SplineSpec,
};
use pentaspline::units::{Steps, AXES};
use pentaspline_fuzz::{check, config, SEGMENTS_MAX};

/// One block, before it is made absolute.
#[derive(Arbitrary, Debug)]
struct Block {
    motion: Shape,
    /// Way in 1e-6 mm or degree, shifted left by `scale`.
    by: [i16; AXES],
    scale: u8,
    absolute: bool,
    feed: f32,
    inverse: bool,
    stop: bool,
    finish: bool,
}

#[derive(Arbitrary, Debug)]
enum Shape {
    Rapid,
    Linear,
    Arc {
        plane: u8,
        clockwise: bool,
        centre: Option<[i16; 2]>,
        radius: i32,
        turns: u16,
    },
    Spline {
        kind: u8,
        ends: [u8; 2],
        degree: u8,
        interval: Option<f32>,
        weight: f32,
        first: bool,
        axes: u8,
        tool: Option<[i16; 3]>,
    },
    Cubic {
        length: i32,
        k: [[i32; 3]; AXES],
    },
    Polynomial {
        length: f32,
        numerators: u8,
        coefficients: [[f32; 4]; AXES],
        denominator: Option<[f32; 5]>,
    },
}

fn condition(byte: u8) -> BoundaryCondition {
    [
        BoundaryCondition::NotAKnot,
        BoundaryCondition::Natural,
        BoundaryCondition::Tangent,
    ][usize::from(byte % 3)]
}

fn motion(shape: &Shape, from: &[i64; AXES], scale: u32) -> Motion {
    match *shape {
        Shape::Rapid => Motion::Rapid,
        Shape::Linear => Motion::Linear,
        Shape::Arc {
            plane,
            clockwise,
            centre,
            radius,
            turns,
        } => {
            let plane = [Plane::Xy, Plane::Zx, Plane::Yz][usize::from(plane % 3)];
            let axes = [[0, 1], [2, 0], [1, 2]][usize::from(plane as u8 % 3)];
            Motion::Arc(Arc {
                plane,
                clockwise,
                centre: match centre {
                    Some(c) => Centre::Point([
                        from[axes[0]] + (i64::from(c[0]) << scale),
                        from[axes[1]] + (i64::from(c[1]) << scale),
                    ]),
                    None => Centre::Radius(i64::from(radius)),
                },
                turns: turns % 1000,
            })
        }
        Shape::Spline {
            kind,
            ends,
            degree,
            interval,
            weight,
            first,
            axes,
            tool,
        } => Motion::Spline(SplineSpec {
            kind: [SplineKind::Akima, SplineKind::BSpline, SplineKind::Cubic]
                [usize::from(kind % 3)],
            begin: condition(ends[0]),
            end: condition(ends[1]),
            degree: degree % 5,
            interval,
            weight,
            first,
            axes,
            tool_point: tool.map(|t| [0, 1, 2].map(|a| from[a] + (i64::from(t[a]) << scale))),
        }),
        Shape::Cubic { length, k } => Motion::Cubic(CubicBlock {
            length: i64::from(length),
            k: k.map(|row| row.map(i64::from)),
        }),
        Shape::Polynomial {
            length,
            numerators,
            coefficients,
            denominator,
        } => Motion::Polynomial(Polynomial {
            length: f64::from(length),
            numerators,
            coefficients: coefficients.map(|row| row.map(f64::from)),
            denominator: denominator.map_or([1.0, 0.0, 0.0, 0.0, 0.0], |row| row.map(f64::from)),
        }),
    }
}

fuzz_target!(|blocks: Vec<Block>| {
    let config = config(Dialect::Sinumerik);
    let origin = [Steps::ZERO; AXES];
    let mut builder = SegmentBuilder::new(&config, origin);
    let mut at = [0_i64; AXES];
    let mut end = origin;
    for (number, block) in (1..).zip(&blocks) {
        let scale = u32::from(block.scale % 16);
        let mut target = if block.absolute { [0; AXES] } else { at };
        for (x, by) in target.iter_mut().zip(block.by) {
            *x += i64::from(by) << scale;
        }
        let result = builder.push(
            &config,
            &Move {
                block: number,
                motion: motion(&block.motion, &at, scale),
                target,
                feed: block.feed,
                feed_type: if block.inverse {
                    FeedType::Inverse
                } else {
                    FeedType::PerTime
                },
                exact_stop: block.stop,
                soft: true,
                rounding: Default::default(),
                cutter: Cutter::OFF,
            },
        );
        let result = match result {
            Ok(()) => {
                at = target;
                Ok(())
            }
            Err(error) => Err(error),
        };
        // Segments up to the error were handed on in good faith, so they are drained first.
        drain(&mut builder, &config, &mut end);
        let result = match result {
            Ok(()) if block.finish => builder.finish(&config),
            other => other,
        };
        drain(&mut builder, &config, &mut end);
        if result.is_err() {
            builder.reset(origin);
            at = [0; AXES];
            end = origin;
        }
    }
    if builder.finish(&config).is_ok() {
        drain(&mut builder, &config, &mut end);
        // Open still only if the end of the curve has met something, which it now reports.
        if builder.is_open() {
            assert!(
                builder.finish(&config).is_err(),
                "finished and still open without an error"
            );
            assert!(!builder.is_open(), "reported and still open");
        }
    }
});

fn drain(
    builder: &mut SegmentBuilder,
    config: &pentaspline::config::Config,
    end: &mut pentaspline::units::Position,
) {
    for _ in 0..SEGMENTS_MAX {
        let Some(path) = builder.next(config) else {
            return;
        };
        check(config, &path.segment);
        assert_eq!(path.segment.start, *end, "a gap in the path");
        *end = path.segment.end;
    }
    panic!("a block without end");
}
