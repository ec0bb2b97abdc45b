//! The transcription that is proved (`tests/oracle/fixed_point.py`) is the core's arithmetic: its vectors, bit for bit.

use pentaspline::interpolator::braking::{BrakeLimits, Braking};
use pentaspline::interpolator::motion::{Motion, Wide};
use pentaspline::interpolator::segment::{AxisCurve, ServoSegment};
use pentaspline::stepgen::StepGenerator;
use pentaspline::units::{phase, AXES};

const VECTORS: &str = include_str!("../oracle/data/fixed_point.csv");

/// Results of the core for the inputs of a row, and how many numbers at its end are results.
fn computed(kind: &str, row: &[i128]) -> (Vec<i128>, usize) {
    match kind {
        "at" => {
            let [length, left, base, slope, c1, c2, c3, c4, c5, scale, ..] = *row else {
                panic!("a short row");
            };
            let curve = AxisCurve {
                base: base as i64,
                slope: slope as i32,
                fine: [c1, c2, c3, c4, c5].map(|c| c as i32),
            };
            let segment = ServoSegment::new(1, length as i64, [curve; AXES]);
            let place = segment.place(Wide::new(left));
            let at = segment.axes[0].at(&place, scale as i32);
            if curve.is_straight() {
                assert_eq!(curve.at_straight(&place, scale as i32), at);
            }
            let place = [place.high, place.low, place.fine].map(i128::from);
            ([&place[..], &[i128::from(at)]].concat(), 4)
        }
        "motion" => {
            let [left, v, a] = [0, 1, 2].map(|k| Wide::new(row[k]));
            let mut motion = Motion { left, v, a };
            for _ in 0..3 {
                motion.step(row[3] as i64);
            }
            let Motion { left, v, a } = motion;
            (vec![left.get(), v.get(), a.get()], 3)
        }
        "brake" => {
            let limits = BrakeLimits {
                a: row[0] as u32,
                j: row[1] as u32,
                ..Default::default()
            };
            let (mut v, mut d) = (row[2], row[3]);
            let braking = Braking::new(&limits, v, d);
            let found = (0..4).map(|_| {
                d = braking.next(v, d);
                v -= d;
                d
            });
            (found.collect(), 4)
        }
        "edges" => {
            let mut generator = StepGenerator::new([row[0] as i64; AXES], 2, 4);
            generator.begin();
            generator.lead(3, phase(row[1] as i64));
            let edges = generator.frame().copied().unwrap_or_default().axes[3];
            let found = [
                i128::from(edges.count),
                i128::from(edges.negative),
                i128::from(edges.first),
                i128::from(edges.pitch),
            ];
            (found.to_vec(), 4)
        }
        other => panic!("no {other}"),
    }
}

#[test]
fn the_core_computes_what_the_transcription_does() {
    let mut rows = 0;
    for (number, line) in VECTORS.lines().enumerate() {
        let (kind, numbers) = line.split_once(',').expect("a name");
        let row: Vec<i128> = numbers
            .split(',')
            .map(|n| n.parse().expect("a number"))
            .collect();
        let (found, results) = computed(kind, &row);
        assert_eq!(
            found,
            row[row.len() - results..],
            "row {}: {line}",
            number + 1
        );
        rows += 1;
    }
    assert!(rows > 4000);
}
