//! Random contours through the cutter compensation: no panic, no endless work, finite segments that join exactly. Where
//! the compensation is off, what goes in comes out, bit for bit.
#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use pentaspline::compensation::{Compensator, Output};
use pentaspline::config::{Config, Dialect};
use pentaspline::geometry::{HermiteSegment, PathSegment, SegmentBuilder};
use pentaspline::nc::command::{
    Arc, Auxiliary, Centre, Command, Corner, Cutter, FeedReference, FeedType, Motion, Move, Plane,
    Side,
};
use pentaspline::units::{Position, Steps, AXES};
use pentaspline_fuzz::{check, config, SEGMENTS_MAX};

#[derive(Arbitrary, Debug)]
struct Input {
    radius: u16,
    scale: u8,
    blocks: Vec<Block>,
}

#[derive(Arbitrary, Debug)]
enum Block {
    /// By the geometry stage: straight or an arc.
    Move {
        by: [i8; 3],
        fine: [i8; 2],
        arc: Option<(bool, i8)>,
        rapid: bool,
        stop: bool,
    },
    /// A cubic as a spline would give it.
    Cubic {
        by: [i8; 3],
        slopes: [[i8; 2]; 2],
    },
    Side(u8),
    Corner(bool),
    Radius(u16),
    Plane(u8),
    Command,
    Finish,
}

/// What goes through.
struct Stage {
    compensator: Compensator,
    end: Position,
    failed: bool,
}

impl Stage {
    fn drain(&mut self, config: &Config) {
        for _ in 0..SEGMENTS_MAX {
            match self.compensator.next(config, &mut || {}) {
                Ok(Some(Output::Segment(path))) => {
                    check(config, &path.segment);
                    assert_eq!(path.segment.start, self.end, "a gap in the path");
                    assert!(path.feed > 0.0, "{path:?}");
                    self.end = path.segment.end;
                }
                Ok(Some(Output::Command(_))) => {}
                Ok(None) => return,
                Err(_) => {
                    self.failed = true;
                    return;
                }
            }
        }
        panic!("an output without end");
    }

    fn push(&mut self, config: &Config, path: &PathSegment) {
        if self.failed {
            return;
        }
        assert!(!self.compensator.is_full(), "drained and full");
        if self
            .compensator
            .push_segment(config, path, &mut || {})
            .is_err()
        {
            self.failed = true;
            return;
        }
        self.drain(config);
    }
}

fuzz_target!(|input: Input| {
    let config = config(Dialect::Sinumerik);
    let origin = [Steps::ZERO; AXES];
    let scale = 10_i64.pow(u32::from(input.scale % 4));
    let mut cutter = Cutter {
        radius: i64::from(input.radius) * 1000,
        ..Cutter::OFF
    };
    let mut stage = Stage {
        compensator: Compensator::new(),
        end: origin,
        failed: false,
    };
    stage.compensator.reset(origin);
    let mut builder = SegmentBuilder::new(&config, origin);
    let mut at = [0_i64; AXES];
    for (number, block) in (1..).zip(&input.blocks) {
        if stage.failed {
            stage.compensator.reset(origin);
            builder.reset(origin);
            (stage.end, stage.failed, at) = (origin, false, [0; AXES]);
        }
        match *block {
            Block::Move {
                by,
                fine,
                arc,
                rapid,
                stop,
            } => {
                let mut target = at;
                for k in 0..3 {
                    target[k] += i64::from(by[k]) * 1000 * scale;
                }
                for k in 0..2 {
                    target[k] += i64::from(fine[k]);
                }
                let motion = match arc {
                    Some((clockwise, radius)) => Motion::Arc(Arc {
                        plane: cutter.plane,
                        clockwise,
                        centre: Centre::Radius(i64::from(radius) * 2000 * scale),
                        turns: 0,
                    }),
                    None if rapid => Motion::Rapid,
                    None => Motion::Linear,
                };
                let block = Move {
                    block: number,
                    motion,
                    target,
                    feed: 20.0,
                    feed_type: FeedType::PerTime,
                    exact_stop: stop,
                    soft: true,
                    rounding: Default::default(),
                    cutter,
                };
                if builder.push(&config, &block).is_err() {
                    while builder.next(&config).is_some() {}
                    stage.failed = true;
                    continue;
                }
                at = target;
                while let Some(path) = builder.next(&config) {
                    stage.push(&config, &path);
                }
            }
            Block::Cubic { by, slopes } => {
                let mut target = at;
                for k in 0..3 {
                    target[k] += i64::from(by[k]) * 1000 * scale;
                }
                let position = |nano: &[i64; AXES]| -> Position {
                    core::array::from_fn(|a| {
                        config.steps_from_nano(a, nano[a]).unwrap_or(Steps::ZERO)
                    })
                };
                let slope = |s: [i8; 2]| {
                    let unit = scale as f32 / 1000.0;
                    [
                        f32::from(s[0]) * unit,
                        f32::from(s[1]) * unit,
                        0.0,
                        0.0,
                        0.0,
                    ]
                };
                let path = PathSegment {
                    segment: HermiteSegment {
                        start: position(&at),
                        end: position(&target),
                        slope_start: slope(slopes[0]),
                        slope_end: slope(slopes[1]),
                    },
                    block: number,
                    feed: 20.0,
                    exact_stop: false,
                    soft: true,
                    rounding: Default::default(),
                    spline: true,
                    cutter,
                };
                stage.push(&config, &path);
                at = target;
                builder.reset(path.segment.end);
            }
            Block::Side(side) => {
                cutter.side = [Side::On, Side::Left, Side::Right][usize::from(side % 3)];
            }
            Block::Corner(arc) => {
                cutter.corner = if arc {
                    Corner::Arc
                } else {
                    Corner::Intersection
                };
                cutter.feed = if arc {
                    FeedReference::Contour
                } else {
                    FeedReference::Inside
                };
            }
            Block::Radius(radius) => cutter.radius = i64::from(radius) * 1000,
            Block::Plane(plane) => {
                cutter.plane = [Plane::Xy, Plane::Zx, Plane::Yz][usize::from(plane % 3)];
            }
            Block::Command => {
                let command = Command::Auxiliary(Auxiliary::CoolantOn);
                if stage.compensator.push_command(&config, command).is_err() {
                    stage.failed = true;
                } else {
                    stage.drain(&config);
                }
            }
            Block::Finish => {
                if stage.compensator.finish(&config, &mut || {}).is_err() {
                    stage.failed = true;
                } else {
                    stage.drain(&config);
                    assert!(
                        stage.failed || !stage.compensator.has_pending(),
                        "finished and pending"
                    );
                }
            }
        }
    }
});
