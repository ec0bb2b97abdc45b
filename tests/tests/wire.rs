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
