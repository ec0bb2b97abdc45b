//! Rounded corners on the whole product: text in, commanded positions out. The path is judged against the vertices of the program,
//! which are numbers here before they become text.

use pentaspline::config::Config;
use pentaspline::machine::Event;
use pentaspline::units::AXES;
use whole_product_tests::drive::{drive, with_rig, Run, Script, Sender};
use whole_product_tests::oracle::spline::Point;
use whole_product_tests::{examples, laws};

/// Vertices in 1e-3 mm and degree: X, Y, C.
type Vertex = [i32; 3];

fn at(vertex: &Vertex) -> Point {
    let [x, y, c] = vertex.map(|value| f64::from(value) * 1e-3);
    [x, y, 0.0, 0.0, c]
}

fn program(header: &str, vertices: &[Vertex]) -> String {
    let mut text = format!("G54 G90 SOFT\nG1 F6000\n{header}\n");
    for vertex in vertices {
        let [x, y, .., c] = at(vertex);
        text.push_str(&format!("X{x:.3} Y{y:.3} C{c:.3}\n"));
    }
    text.push_str("M30\n");
    text
}

/// Regular polygon of `sides`, first and last vertex the same; C swings by `swing` to and fro.
fn polygon(sides: u32, radius: f64, swing: f64) -> Vec<Vertex> {
    let vertex = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k % sides) / f64::from(sides);
        let c = if k.is_multiple_of(2) { 0.0 } else { swing };
        [radius * angle.cos(), radius * angle.sin(), c].map(|v| (v * 1e3).round() as i32)
    };
    (0..=sides).map(vertex).collect()
}

fn run(config: &Config, text: &str) -> Run {
    let run = drive(config, &Script::new(text));
    assert!(run.finished, "{}", run.output);
    assert!(!run.output.contains("error"), "{}", run.output);
    laws::emits_exactly_the_commanded_steps(&run).unwrap();
    run
}

/// How far `place` is from the polyline in units of `scale` of each axis, the largest axis counting; and from its nearest
/// vertex, mm.
fn off(vertices: &[Vertex], place: &Point, scale: &Point) -> (f64, f64) {
    let measure = |p: &Point| {
        (0..AXES)
            .map(|a| (p[a] - place[a]).abs() / scale[a])
            .fold(0.0, f64::max)
    };
    let mut nearest = f64::INFINITY;
    for pair in vertices.windows(2) {
        let (p, q) = (at(&pair[0]), at(&pair[1]));
        let between = |t: f64| -> Point { core::array::from_fn(|a| p[a] + t * (q[a] - p[a])) };
        // convex in t
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let third = (high - low) / 3.0;
            if measure(&between(low + third)) < measure(&between(high - third)) {
                high -= third;
            } else {
                low += third;
            }
        }
        nearest = nearest.min(measure(&between(low)));
    }
    let corner = vertices.iter().map(|vertex| {
        let vertex = at(vertex);
        (place[0] - vertex[0]).hypot(place[1] - vertex[1])
    });
    (nearest, corner.fold(f64::INFINITY, f64::min))
}

/// The places of a run from its first vertex on, every `every`th tick.
fn places(config: &Config, run: &Run, every: usize) -> Vec<Point> {
    // line 4 leads to the first vertex
    let ticks = run
        .ticks
        .iter()
        .filter(|tick| tick.block > 4)
        .step_by(every);
    ticks.map(|tick| laws::place(config, tick)).collect()
}

fn ends_on(run: &Run, vertex: &Vertex) {
    let [x, y, c] = *vertex;
    assert_eq!(run.end(), [x, y, 0, 0, c]);
}

/// Least time from rest to rest over `length` mm at up to `v` with acceleration `a` and jerk `j`, s.
fn rest_to_rest(length: f64, v: f64, a: f64, j: f64) -> f64 {
    let ramp = |v: f64| {
        if v * j < a * a {
            2.0 * (v / j).sqrt()
        } else {
            v / a + a / j
        }
    };
    if v * ramp(v) <= length {
        return 2.0 * ramp(v) + (length - v * ramp(v)) / v;
    }
    let (mut slow, mut fast) = (0.0, v);
    for _ in 0..60 {
        let middle = 0.5 * (slow + fast);
        if middle * ramp(middle) <= length {
            slow = middle;
        } else {
            fast = middle;
        }
    }
    2.0 * ramp(slow)
}

/// Least time of the sides of a polygon with a rest at each vertex, in ticks: limits along a side are those of the axis that
/// moves most.
fn least_with_stops(config: &Config, vertices: &[Vertex], v: f64) -> f64 {
    let mut from = [0.0, 0.0];
    let mut time = 0.0;
    for &[x, y, _] in vertices {
        let to = [x, y].map(|um| f64::from(um) * 1e-3);
        let side = [to[0] - from[0], to[1] - from[1]];
        let length = side[0].hypot(side[1]);
        if length > 0.0 {
            let most = side[0].abs().max(side[1].abs()) / length;
            let [a, j] = [config.axes[0].a_max, config.axes[0].j_max].map(f64::from);
            time += rest_to_rest(length, v, a / most, j / most);
        }
        from = to;
    }
    time * f64::from(config.servo_hz)
}

#[test]
fn a_polygon_rounds_no_more_than_asked_and_is_faster_where_it_may_be() {
    let config = examples::machine().config;
    // Corners of 30 degrees, 0.5 mm, cost a little more than a stop on this machine; flatter or longer ones less.
    for (sides, adis, share) in [
        (12, 0.5, 1.11),
        (12, 5.0, 0.7),
        (40, 0.5, 0.75),
        (40, 1.5, 0.45),
    ] {
        let vertices = polygon(sides, 25.0, 0.0);
        let exact = least_with_stops(&config, &vertices, 100.0);
        let rounded = run(&config, &program(&format!("G641 ADIS={adis}"), &vertices));
        let ratio = rounded.moving() as f64 / exact;
        println!("{sides} sides, ADIS {adis}: {ratio:.3} of the least time with stops");
        assert!(ratio < share, "{sides} sides, ADIS {adis}: {ratio}");
        ends_on(&rounded, vertices.last().unwrap());
        // The triangle of a corner is as high as half its turn says.
        let height = adis * (std::f64::consts::PI / f64::from(sides)).sin();
        for place in places(&config, &rounded, 5) {
            let (path, corner) = off(&vertices, &place, &[1.0; AXES]);
            assert!(
                path < 2e-5 || corner < adis + 1e-4,
                "{place:?} {path} {corner}"
            );
            assert!(path < height + 2e-5, "{place:?} {path}");
        }
    }
}

#[test]
fn every_axis_keeps_its_tolerance_rotary_ones_too() {
    let mut config = examples::machine().config;
    config.axes[4].rounding_tolerance = 0.002;
    config.axes[1].rounding_tolerance = 0.02;
    let scale: Point = config.axes.map(|axis| f64::from(axis.rounding_tolerance));
    for (sides, swing) in [(12, 0.0), (7, 0.3), (90, 0.01)] {
        let vertices = polygon(sides, 20.0, swing);
        let rounded = run(&config, &program("G642", &vertices));
        ends_on(&rounded, vertices.last().unwrap());
        let most = places(&config, &rounded, 3)
            .iter()
            .map(|place| off(&vertices, place, &scale).0)
            .fold(0.0, f64::max);
        assert!(most <= 1.0, "{most} of the tolerance");
        assert!(most > 0.2, "{most}: nothing was rounded");
    }
}

#[test]
fn stops_are_met_exactly_between_rounded_corners() {
    let config = examples::machine().config;
    let text = "G54 G90 G1 F3000 G641 ADIS=1 ADISPOS=1\nX5\nY5 G9\nX0\nM5\nY10\nG4 F0.02\nX5\nG0 Y15\nG1 X0\nM30\n";
    let run = run(&config, text);
    let passed = |x: i64, y: i64| {
        let (x, y) = ((x * 1000) << 32, (y * 1000) << 32);
        run.ticks.iter().any(|tick| tick.commanded[..2] == [x, y])
    };
    for (x, y) in [(5, 5), (0, 5), (0, 10)] {
        assert!(passed(x, y), "{x} {y}");
    }
    // the corner of line 2 is not met, those between feed and rapid motion are
    assert!(!passed(5, 0));
    let met = |x: f64, y: f64| {
        let near = run.ticks.iter().map(|tick| {
            let place = laws::place(&config, tick);
            (place[0] - x).hypot(place[1] - y)
        });
        near.fold(f64::INFINITY, f64::min) < 2e-3
    };
    assert!(met(5.0, 10.0) && met(5.0, 15.0) && !met(5.0, 0.0));
    assert_eq!(run.end(), [0, 15_000, 0, 0, 0]);
}

#[test]
fn how_the_text_arrives_makes_no_difference() {
    let config = examples::machine().config;
    for header in ["G641 ADIS=3", "G642"] {
        let text = program(header, &polygon(40, 15.0, 0.02));
        let whole = run(&config, &text);
        for seed in 1..=3 {
            let sender = Sender::Bursts {
                seed,
                bytes: 60,
                gap: 10,
            };
            let script = Script {
                sender,
                ..Script::new(&text)
            };
            let parted = drive(&config, &script);
            assert_eq!(parted.digest, whole.digest, "{header}, seed {seed}");
        }
    }
}

#[test]
fn what_is_held_back_is_driven_when_nothing_comes_and_before_a_line_that_is_refused() {
    let config = examples::machine().config;
    for (last, end) in [("", [5000, 7000, 0, 0, 0]), ("Q1\n", [5000, 7000, 0, 0, 0])] {
        with_rig(&config, |rig| {
            rig.send(format!("G1 F3000 G641 ADIS=1\nX5\nY7\n{last}").as_bytes());
            rig.advance(60_000);
            assert_eq!(rig.run.end(), end, "{last:?} {}", rig.run.output);
            assert!(rig.controller.is_idle());
            // and on from there
            rig.controller.event(Event::Resume);
            rig.send(b"X0\nY0\nM30\n");
            assert!(rig.until_idle(60_000));
            assert_eq!(rig.run.end(), [0; AXES], "{last:?}");
        });
    }
}

#[test]
fn the_example_runs_and_rests_where_it_says() {
    let config = examples::machine().config;
    let run = run(&config, &examples::text("rounded_corners.nc"));
    laws::never_runs_backwards(&run).unwrap();
    assert_eq!(run.end(), [0; AXES]);
    let rest = [-30_000, -30_000, 0, 0, 0].map(|steps: i64| steps << 32);
    assert!(run.ticks.iter().any(|tick| tick.commanded == rest));
}
