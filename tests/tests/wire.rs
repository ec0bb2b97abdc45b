//! The line protocol as senders of GRBL 1.1 rely on it, at the core: bytes in, bytes out.

use std::collections::VecDeque;

use pentaspline::machine::State;
use pentaspline::protocol::RECEIVE_SIZE;
use proptest::prelude::*;
use whole_product_tests::drive::{with_rig, Rig};
use whole_product_tests::examples;

/// A core that has said its banner.
fn bench(work: impl FnOnce(&mut Rig<'_>)) {
    let config = examples::machine().config;
    with_rig(&config, |rig| {
        rig.settle();
        let banner = rig.said();
        assert!(banner.trim_start().starts_with("Grbl 1.1"), "{banner:?}");
        work(rig);
    });
}

/// Sends `line` and gives back what is said to it before the next tick.
fn ask(rig: &mut Rig<'_>, line: &str) -> String {
    rig.send(line.as_bytes());
    rig.said()
}

#[test]
fn the_banner_comes_once_and_first() {
    let config = examples::machine().config;
    let run = with_rig(&config, |rig| rig.advance(1000));
    assert_eq!(
        run.remarks().collect::<Vec<_>>(),
        ["Grbl 1.1h ['$' for help]"]
    );
}

#[test]
fn identity_names_version_buffers_and_axes() {
    bench(|rig| {
        let said = ask(rig, "$I\n");
        let lines: Vec<&str> = said.lines().map(str::trim).collect();
        assert!(
            lines[0].starts_with("[VER:1.1h.") && lines[0].ends_with("Pentaspline MCV 1210]"),
            "{said}"
        );
        let buffers = lines[1]
            .strip_prefix("[OPT:V,")
            .and_then(|rest| rest.strip_suffix(']'));
        let (blocks, bytes) = buffers
            .and_then(|b| b.split_once(','))
            .expect("[OPT:V,blocks,bytes]");
        assert!(blocks.parse::<usize>().is_ok_and(|n| n >= 128), "{blocks}");
        assert_eq!(bytes.parse(), Ok(RECEIVE_SIZE - 1));
        assert_eq!(lines[2], "[AXS:5:XYZAC]");
        assert_eq!(lines[3], "ok");
    });
}

/// Fields of a status report by name, in order.
fn fields(report: &str) -> Vec<(String, String)> {
    let inner = report
        .trim()
        .strip_prefix('<')
        .and_then(|r| r.strip_suffix('>'));
    let mut parts = inner.unwrap_or_else(|| panic!("{report:?}")).split('|');
    let mut out = vec![("State".to_owned(), parts.next().unwrap_or("").to_owned())];
    out.extend(parts.map(|part| {
        let (name, value) = part.split_once(':').unwrap_or_else(|| panic!("{report:?}"));
        (name.to_owned(), value.to_owned())
    }));
    out
}

#[test]
fn a_status_report_has_the_fields_senders_read() {
    bench(|rig| {
        rig.send(b"G1 X-1.5 Y2 F3000\n");
        assert!(rig.until_idle(50_000));
        rig.said();
        let report = fields(&ask(rig, "?"));
        let value = |name: &str| {
            let found = report.iter().find(|field| field.0 == name);
            &found.unwrap_or_else(|| panic!("no {name} in {report:?}")).1
        };
        assert_eq!(value("State"), "Idle");
        assert_eq!(value("MPos"), "-1.500,2.000,0.000,0.000,0.000");
        assert_eq!(value("WCO"), "0.000,0.000,0.000,0.000,0.000");
        assert_eq!(value("FS"), "0,0");
        let (blocks, bytes) = value("Bf").split_once(',').expect("two numbers");
        assert!(blocks.parse::<usize>().is_ok_and(|n| n >= 128));
        assert_eq!(bytes.parse(), Ok(RECEIVE_SIZE - 1), "nothing waits");
        // One sender cuts the report at the closing bracket and loses the last field.
        assert_ne!(report.last().expect("fields").0, "MPos");
    });
}

#[test]
fn a_status_report_shows_feed_line_and_state_in_motion() {
    bench(|rig| {
        rig.send(b"\nG1 X50 F3000\n");
        rig.advance(3500);
        rig.said();
        let report = fields(&ask(rig, "?"));
        assert_eq!(report[0].1, "Run");
        let feed = report.iter().find(|f| f.0 == "FS").expect("FS");
        let feed: f64 = feed
            .1
            .split(',')
            .next()
            .and_then(|f| f.parse().ok())
            .expect("a number");
        assert!((feed - 3000.0).abs() <= 1.0, "{feed}");
        assert!(report.contains(&("Ln".into(), "2".into())), "{report:?}");
        assert_eq!(fields(&ask(rig, "!?"))[0].1, "Hold:0");
    });
}

#[test]
fn a_status_request_takes_no_buffer_and_splits_no_line() {
    bench(|rig| {
        rig.send(b"G1 X?2 F30?00\n");
        assert!(rig.until_idle(50_000));
        let said = rig.said();
        assert!(!said.contains("error"), "{said}");
        assert_eq!(rig.run.end()[0], 2000);
    });
}

#[test]
fn every_line_is_answered_once_the_empty_ones_too() {
    bench(|rig| {
        rig.send(b"\n\n  \n; nothing\nF100\n");
        rig.advance(10);
        assert_eq!(rig.said().matches("ok").count(), 5);
    });
}

#[test]
fn an_error_latches_until_cycle_start() {
    bench(|rig| {
        let said = ask(rig, "G1 X1 Q2 F600\n");
        assert!(
            said.contains("[MSG:error line 1 column 7: unknown word 'Q']\r\nerror:105\r\n"),
            "{said}"
        );
        assert_eq!(rig.controller.state(), State::Alarm);
        let locked = ask(rig, "G1 X5 F600\n");
        assert!(
            locked.starts_with("error:") && !locked.contains("ok"),
            "{locked}"
        );
        rig.advance(5000);
        assert_eq!(rig.run.end()[0], 0, "nothing moves behind an error");
        rig.send(b"~");
        assert_eq!(rig.controller.state(), State::Idle);
        assert!(ask(rig, "G1 X2 F600\n").contains("ok"));
        assert!(rig.until_idle(50_000));
        assert_eq!(rig.run.end()[0], 2000);
    });
}

#[test]
fn a_reset_answers_with_a_banner_and_forgets() {
    bench(|rig| {
        rig.send(b"G91\nG1 X9 F600\nX9\nX9\n");
        rig.advance(200);
        rig.said();
        rig.send(&[0x18]);
        assert!(rig.until_idle(20_000), "comes to rest");
        rig.settle();
        let said = rig.said();
        assert_eq!(said.matches("Grbl 1.1").count(), 1, "{said}");
        let rest = rig.run.end();
        assert!(rest[0] < 9000, "{rest:?}");
        rig.advance(5000);
        assert_eq!(rig.run.end(), rest, "nothing of the old program moves");
        assert_eq!(rig.controller.state(), State::Idle);
        // G91 and F are forgotten: X1 is absolute, and G1 asks for a feed.
        assert!(ask(rig, "G1 X1\n").contains("error:119"));
        rig.send(b"~");
        rig.send(b"G1 X1 F600\n");
        assert!(rig.until_idle(50_000));
        assert_eq!(rig.run.end()[0], 1000);
    });
}

#[test]
fn a_reset_clears_an_error() {
    bench(|rig| {
        ask(rig, "Q\n");
        rig.send(&[0x18]);
        assert!(rig.until_idle(1000));
        rig.settle();
        assert!(rig.said().contains("Grbl 1.1"));
        assert!(ask(rig, "F100\n").contains("ok"));
    });
}

#[test]
fn bytes_from_0x80_up_are_dropped_in_silence() {
    bench(|rig| {
        let mut line = b"G1 X2 F600\n".to_vec();
        for (at, byte) in (0x80..=0xff).enumerate() {
            line.insert(at % 10, byte);
        }
        rig.send(&line);
        assert!(rig.until_idle(50_000));
        let said = rig.said();
        assert_eq!(said.trim(), "ok", "{said}");
        assert_eq!(rig.run.end()[0], 2000);
    });
}

#[test]
fn a_line_of_127_bytes_is_refused_and_stalls_nothing() {
    bench(|rig| {
        let long = format!("G1 X1 F600 ;{}\n", "x".repeat(127 - 12));
        assert_eq!(long.len(), 128);
        let said = ask(rig, &long);
        assert!(said.contains("error:101"), "{said}");
        rig.send(b"~");
        assert!(ask(rig, "F100\n").contains("ok"));
        // One that does not even fit into the buffer.
        let said = ask(rig, &format!("G1 {}\n", "9".repeat(3000)));
        assert!(said.contains("error:101"), "{said}");
        rig.send(b"~");
        assert!(ask(rig, "F100\n").contains("ok"));
        assert_eq!(rig.run.moving(), 0);
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// A sender that counts characters never finds the buffer full, and loses no answer.
    #[test]
    fn character_counting_never_overflows(
        comments in prop::collection::vec(0_usize..80, 1..200),
        bursts in prop::collection::vec(1_usize..400, 1..50),
    ) {
        let config = examples::machine().config;
        let lines: Vec<String> = comments
            .iter()
            .enumerate()
            .map(|(k, n)| format!("G1 X{}.5 F6000;{}\n", k % 7, "c".repeat(*n)))
            .collect();
        let last = (lines.len() - 1) % 7;
        let mut answered = 0;
        let run = with_rig(&config, |rig| {
            rig.settle();
            rig.said();
            let capacity = RECEIVE_SIZE - 1;
            let mut in_flight: VecDeque<usize> = VecDeque::new();
            let mut waiting: VecDeque<u8> = VecDeque::new();
            let mut next = 0;
            let mut turn = 0;
            while answered < lines.len() && rig.now < 3_000_000 {
                while next < lines.len()
                    && in_flight.iter().sum::<usize>() + lines[next].len() <= capacity
                {
                    in_flight.push_back(lines[next].len());
                    waiting.extend(lines[next].bytes());
                    next += 1;
                }
                for _ in 0..bursts[turn % bursts.len()].min(waiting.len()) {
                    // A full buffer here would lose a byte.
                    assert!(rig.controller.receive_free() > 1, "overflow");
                    rig.controller.receive(waiting.pop_front().expect("counted"));
                }
                turn += 1;
                rig.advance(1);
                for line in rig.said().lines().filter(|line| !line.is_empty()) {
                    assert_eq!(line, "ok");
                    answered += 1;
                    in_flight.pop_front();
                }
            }
            assert!(rig.until_idle(100_000));
        });
        prop_assert_eq!(answered, lines.len());
        prop_assert_eq!(run.end()[0], last as i32 * 1000 + 500);
    }
}

/// Lines answered one by one: only the last word of each answer counts.
fn verdicts(rig: &mut Rig<'_>, text: &str) -> Vec<String> {
    rig.send(text.as_bytes());
    let said = rig.said();
    let words = said.lines().map(str::trim);
    words
        .filter(|word| *word == "ok" || word.starts_with("error:"))
        .map(str::to_owned)
        .collect()
}

/// Sends `text`, lets it run, and wants no complaint.
fn run_through(rig: &mut Rig<'_>, text: &str) {
    rig.send(text.as_bytes());
    assert!(rig.until_idle(200_000), "{text}");
    let said = rig.said();
    assert!(!said.contains("error"), "{said}\n{text}");
}

#[test]
fn the_dialect_is_told_and_chosen() {
    const NURBS: &str = "G90 G94 F3000\nG01 X1 Y0\nG06.2 P3 K0 X1 Y0 R1\nK0 X3 Y5\nK0 X7 Y5\nK1 X9 Y0\nK2\nK2\nK2\nG01 X10\n";
    bench(|rig| {
        assert_eq!(ask(rig, "$DIALECT\n"), "[DIALECT:SINUMERIK]\r\nok\r\n");
        assert!(ask(rig, "G06.2 P3 K0 X1 Y0 R1\n").contains("error:"));
        rig.send(b"~");
        for choice in ["$DIALECT FANUC\n", "$dialectfanuc\n", "$Dialect  Fanuc\r\n"] {
            assert_eq!(ask(rig, "$DIALECT SINUMERIK\n"), "ok\r\n");
            assert_eq!(ask(rig, choice), "ok\r\n", "{choice:?}");
            assert_eq!(ask(rig, "$dialect\n"), "[DIALECT:FANUC]\r\nok\r\n");
            run_through(rig, NURBS);
            assert_eq!(rig.run.end()[..2], [10_000, 0]);
            run_through(rig, "G0 X0\n");
        }
        assert_eq!(ask(rig, "$DIALECT HEIDENHAIN\n"), "ok\r\n");
        run_through(
            rig,
            "0 BEGIN PGM A MM\n1 L X+3 IY-2 R0 F3000\n2 END PGM A MM\n",
        );
        assert_eq!(rig.run.end()[..2], [3000, -2000]);
        assert_eq!(verdicts(rig, "$DIALECT MARLIN\n"), ["error:3"]);
        assert_eq!(ask(rig, "$DIALECT\n"), "[DIALECT:HEIDENHAIN]\r\nok\r\n");
    });
}

#[test]
fn the_dialect_stays_while_anything_read_waits_to_be_completed() {
    for (dialect, opened, rest) in [
        (
            "SINUMERIK",
            "G1 F3000 X1\nCSPLINE X5 Y4\nX9 Y1\n",
            "X15 Y3\nX20 Y0\nG1 X25\nM30\n",
        ),
        (
            "SINUMERIK",
            "G1 F3000 X1\nPOLY\nPOX Q0.5\n",
            "X5 Y2 PL1\nM30\n",
        ),
        (
            "SINUMERIK",
            "G1 F3000\nG6 X1 I1\n",
            "K0 K0 K-268435456\nM30\n",
        ),
        (
            "FANUC",
            "G1 F3000 X1\nG06.2 P2 K0 X1 Y0\nK0 X5 Y1\n",
            "K1 X9 Y0\nK2\nK2\nG01 X10\nM30\n",
        ),
        (
            "HEIDENHAIN",
            "L X+1 F3000\nSPL X+4 Y+1 K3X0 K2X0 K1X-3\n",
            "K3Y0 K2Y0 K1Y-1\nEND PGM A MM\n",
        ),
    ] {
        let config = examples::machine().config;
        let run = |asked: bool| {
            with_rig(&config, |rig| {
                rig.send(format!("$DIALECT {dialect}\n{opened}").as_bytes());
                assert!(!rig.said().contains("error"), "{opened}");
                if asked {
                    for other in ["SINUMERIK", "FANUC", "HEIDENHAIN"] {
                        let answer = verdicts(rig, &format!("$DIALECT {other}\n"));
                        assert_eq!(answer, ["error:205"], "{dialect} to {other}\n{opened}");
                    }
                    assert!(ask(rig, "$DIALECT\n").contains(dialect));
                }
                run_through(rig, rest);
                assert_eq!(ask(rig, "$DIALECT FANUC\n"), "ok\r\n");
            })
        };
        assert_eq!(run(true).digest, run(false).digest, "{opened}{rest}");
    }
}

#[test]
fn the_tool_table_is_told_written_and_used() {
    bench(|rig| {
        let rows = |rig: &mut Rig<'_>| -> Vec<String> {
            let said = ask(rig, "$T\n");
            let rows = said.strip_suffix("ok\r\n").expect("an answer");
            rows.lines().map(str::to_owned).collect()
        };
        let before = rows(rig);
        assert!(
            before.iter().all(|row| row.starts_with("[T:")),
            "{before:?}"
        );
        for radius in [3.0, 1.25] {
            run_through(rig, &format!("G10 L1 P7 R{radius} Z0\nT7 M6\n"));
            let row = format!("[T:7||R:{radius:.3}|L:0.000]");
            assert!(rows(rig).contains(&row), "{row}");
            assert_eq!(rows(rig).len(), before.len() + 1, "one row more");
            let start = rig.run.ticks.len();
            run_through(rig, "G0 X-5 Y5\nG41 G1 F3000 X0 Y0\nX20\nG40 Y10\n");
            let along = rig.run.ticks[start..]
                .iter()
                .filter(|tick| (1000..19_000).contains(&tick.emitted[0]) && tick.emitted[1] < 5000);
            // Left of a way along X is +Y; a thousand steps are a millimetre.
            let steps = (radius * 1000.0) as i32;
            let (mut least, mut most, mut ticks) = (i32::MAX, 0, 0);
            for tick in along {
                (least, most) = (least.min(tick.emitted[1]), most.max(tick.emitted[1]));
                ticks += 1;
            }
            assert!(ticks > 1000);
            assert_eq!((least, most), (steps, steps));
        }
    });
}

/// A spline with a bad line in the middle of it.
const BAD_SPLINE: &str = "G1 F3000 X1\nCSPLINE X5 Y4\nX9 Y1\nX12 Q2\nX15 Y3\nX20 Y0\nG1 X30\n";

#[test]
fn an_error_inside_a_spline_holds_up_what_is_buffered_until_cycle_start() {
    bench(|rig| {
        let answers = verdicts(rig, BAD_SPLINE);
        let expected = [
            "ok",
            "ok",
            "ok",
            "error:105",
            "error:9",
            "error:9",
            "error:9",
        ];
        assert_eq!(answers, expected);
        rig.advance(20_000);
        let rest = rig.run.end();
        assert_eq!(rest[..2], [1000, 0], "the open spline is dropped");
        assert_eq!(rig.controller.state(), State::Alarm);
        assert_eq!(verdicts(rig, "X15 Y3\n"), ["error:9"]);
        rig.advance(20_000);
        assert_eq!(rig.run.end(), rest, "nothing moves behind an error");
        rig.send(b"~");
        assert_eq!(rig.controller.state(), State::Idle);
        // From where it stands, as if the spline had never begun.
        run_through(rig, "G1 X2 F600\n");
        assert_eq!(rig.run.end()[..2], [2000, 0]);
    });
}

#[test]
fn an_error_inside_a_spline_holds_up_what_is_buffered_until_a_reset() {
    bench(|rig| {
        verdicts(rig, BAD_SPLINE);
        rig.advance(20_000);
        rig.send(b"\x18");
        assert!(rig.until_idle(20_000));
        assert!(ask(rig, "F100\n").contains("Grbl 1.1"));
        assert_eq!(rig.controller.state(), State::Idle);
        assert_eq!(rig.run.end()[..2], [1000, 0]);
        run_through(rig, "CSPLINE F3000 X5 Y4\nX9 Y1\nG1 X10\n");
        assert_eq!(rig.run.end()[..2], [10_000, 1000]);
    });
}

#[test]
fn a_message_is_shown_and_stops_nothing() {
    let config = examples::machine().config;
    let run = |text: &str| {
        with_rig(&config, |rig| {
            rig.send(text.as_bytes());
            assert!(rig.until_idle(50_000));
        })
    };
    let plain = run("G1 F3000 X10\nX20 Y1\nX30\nM30\n");
    let shown =
        run("G1 F3000 X10\nMSG(\"Half (of) it; done\")\nX20 Y1\nmsg(\"X9\")\nMSG()\nX30\nM30\n");
    let told: Vec<&str> = shown
        .remarks()
        .filter(|line| line.starts_with("[MSG:"))
        .collect();
    assert_eq!(
        told,
        [
            "[MSG:Half (of) it; done]",
            "[MSG:X9]",
            "[MSG:]",
            "[MSG:Pgm End]"
        ]
    );
    assert_eq!(shown.output.matches("ok\r\n").count(), 7);
    assert_eq!(shown.digest, plain.digest);
}

#[test]
fn a_jump_forward_passes_over_lines_up_to_its_label() {
    bench(|rig| {
        let text = "F3000\nGOTOF THERE\nG1 X100\nnot a line at all ]]\nTHERE\nTHEREFORE: X50\nN40 THERE: G1 X5\nX6 Y1\n";
        assert_eq!(verdicts(rig, text), ["ok"; 8]);
        assert!(rig.until_idle(50_000));
        assert_eq!(rig.run.end()[..2], [6000, 1000]);
        let most = rig.run.ticks.iter().map(|tick| tick.emitted[0]).max();
        assert_eq!(most, Some(6000));
        // A program that ends before its label.
        let lost = verdicts(rig, "GOTOF NOWHERE\nX1\nM30\nX2\n");
        assert_eq!(lost[..2], ["ok", "ok"]);
        assert!(
            lost[2].starts_with("error:") && lost[3] == "error:9",
            "{lost:?}"
        );
        rig.advance(20_000);
        assert_eq!(rig.run.end()[..2], [6000, 1000]);
    });
}
