//! The sender against a stand-in controller on a real pseudo-terminal.

use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::JoinHandle;

use super::*;
use crate::pty::PseudoTerminal;

/// A controller that counts what it is sent and answers as it is told.
#[derive(Clone)]
struct StandIn {
    receive_buffer: usize,
    /// Reports `Bf:`.
    tells_buffer: bool,
    /// Answers `?` at all.
    reports: bool,
    state: &'static str,
    /// Time per line.
    delay: Duration,
    /// Line (from 1) refused, and what is said about it before and after the `error:`.
    refuse: Option<(usize, &'static str, &'static str)>,
    /// Stops behind this line until `~`.
    hold_after: Option<usize>,
    /// Says this instead of the answer to a line.
    instead: Option<(usize, &'static str)>,
    /// Falls silent behind this line.
    dies_after: Option<usize>,
    /// What lies in the port from an earlier client.
    stale: &'static str,
}

/// What the stand-in has seen.
#[derive(Default)]
struct Seen {
    lines: Vec<String>,
    fullest: usize,
    holds: usize,
}

impl Default for StandIn {
    fn default() -> Self {
        Self {
            receive_buffer: 128,
            tells_buffer: true,
            reports: true,
            state: "Idle",
            delay: Duration::from_micros(300),
            refuse: None,
            hold_after: None,
            instead: None,
            dies_after: None,
            stale: "",
        }
    }
}

impl StandIn {
    fn start(self) -> (serialport::TTYPort, Arc<AtomicBool>, JoinHandle<Seen>) {
        let terminal = PseudoTerminal::open().unwrap();
        let name = terminal.path().to_str().unwrap().to_owned();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        terminal.write(self.stale.as_bytes()).unwrap();
        let thread = std::thread::spawn(move || self.run(&terminal, &flag));
        let port = serialport::new(name, 115_200)
            .timeout(Duration::from_millis(5))
            .open_native()
            .unwrap();
        (port, stop, thread)
    }

    fn run(self, terminal: &PseudoTerminal, stop: &AtomicBool) -> Seen {
        let mut seen = Seen::default();
        let mut buffer = VecDeque::new();
        let mut held = false;
        let mut dead = false;
        let say = |text: String| assert_eq!(terminal.write(text.as_bytes()).unwrap(), text.len());
        let mut last = false;
        while !last {
            // One more look at the wire after the end: a parting `!` counts.
            last = stop.load(Ordering::Relaxed);
            let mut bytes = [0; 4096];
            let count = terminal.read(&mut bytes).unwrap();
            for &byte in &bytes[..count] {
                match byte {
                    b'?' if self.reports && !dead => {
                        let state = if held {
                            "Hold:0"
                        } else if buffer.is_empty() {
                            self.state
                        } else {
                            "Run"
                        };
                        let free = self.receive_buffer - buffer.len().min(self.receive_buffer);
                        let field = if self.tells_buffer {
                            format!("|Bf:15,{free}")
                        } else {
                            String::new()
                        };
                        say(format!(
                            "<{state}|MPos:0.000,0.000,0.000{field}|FS:0,0>\r\n"
                        ));
                    }
                    b'?' => {}
                    b'~' => held = false,
                    b'!' => {
                        held = true;
                        seen.holds += 1;
                    }
                    _ => buffer.push_back(byte),
                }
            }
            seen.fullest = seen.fullest.max(buffer.len());
            if let Some(end) = buffer
                .iter()
                .position(|&b| b == b'\n')
                .filter(|_| !held && !dead)
            {
                let line: Vec<u8> = buffer.drain(..=end).take(end).collect();
                seen.lines.push(String::from_utf8(line).unwrap());
                let number = seen.lines.len();
                std::thread::sleep(self.delay);
                match (self.refuse, self.instead) {
                    (Some((bad, before, after)), _) if bad == number => {
                        say(format!("{before}error:20\r\n{after}"));
                        held = true;
                    }
                    (_, Some((at, text))) if at == number => say(text.to_owned()),
                    _ => say("ok\r\n".to_owned()),
                }
                held |= self.hold_after == Some(number);
                dead |= self.dies_after == Some(number);
            } else {
                terminal.wait(Duration::from_millis(1)).unwrap();
            }
        }
        seen
    }

    /// Streams `lines` to this stand-in.
    fn try_send(self, lines: &[String], options: Options<'_>) -> (Result<Sent, SendError>, Seen) {
        let (port, stop, thread) = self.start();
        let lines: Vec<&[u8]> = lines.iter().map(String::as_bytes).collect();
        let result = stream(port, &lines, options, &mut |_| {});
        stop.store(true, Ordering::Relaxed);
        (result, thread.join().unwrap())
    }
}

/// A program of `count` lines of many lengths, some empty.
fn program(count: usize) -> Vec<String> {
    (0..count)
        .map(|i| {
            if i % 17 == 3 {
                String::new()
            } else {
                format!("N{i} X{}", "1".repeat(i * 7 % 60))
            }
        })
        .collect()
}

#[test]
fn every_line_arrives_once_in_order_and_the_buffer_never_overflows() {
    for receive_buffer in [70, 128, 1024] {
        let lines = program(150);
        let stand_in = StandIn {
            receive_buffer,
            ..StandIn::default()
        };
        let (result, seen) = stand_in.try_send(&lines, Options::default());
        let sent = result.unwrap();
        assert_eq!(seen.lines, lines);
        assert_eq!((sent.lines, sent.window), (lines.len(), receive_buffer));
        assert!(
            seen.fullest <= receive_buffer,
            "{} of {receive_buffer}",
            seen.fullest
        );
        assert!(sent.in_flight_max > receive_buffer - 70 && sent.in_flight_max <= receive_buffer);
        assert_eq!(
            sent.bytes,
            lines.iter().map(|l| l.len() as u64 + 1).sum::<u64>()
        );
    }
}

#[test]
fn without_a_reported_buffer_the_window_is_that_of_grbl() {
    let lines = program(60);
    let stand_in = StandIn {
        tells_buffer: false,
        ..StandIn::default()
    };
    let (result, seen) = stand_in.try_send(&lines, Options::default());
    assert_eq!(result.unwrap().window, DEFAULT_WINDOW);
    assert!(seen.fullest <= DEFAULT_WINDOW);
}

#[test]
fn the_first_error_names_its_line_whatever_is_in_flight() {
    for bad in [1, 2, 37, 60] {
        for (before, after) in [
            ("", ""),
            ("[MSG:line 1 column 3]\r\n", ""),
            ("", "[MSG:line 1 column 3]\r\n"),
        ] {
            let lines = program(60);
            let stand_in = StandIn {
                receive_buffer: 400,
                refuse: Some((bad, before, after)),
                ..StandIn::default()
            };
            let (result, seen) = stand_in.try_send(&lines, Options::default());
            match result.unwrap_err() {
                SendError::Refused {
                    line,
                    code,
                    message,
                } => {
                    assert_eq!((line, code.as_str()), (bad, "20"));
                    assert_eq!(message.is_some(), !(before.is_empty() && after.is_empty()));
                }
                other => panic!("{other}"),
            }
            assert_eq!(seen.lines.len(), bad);
        }
    }
}

#[test]
fn an_old_message_is_not_blamed_for_an_error() {
    let lines = program(30);
    let stand_in = StandIn {
        refuse: Some((20, "", "")),
        instead: Some((5, "[MSG:spindle on]\r\nok\r\n")),
        ..StandIn::default()
    };
    match stand_in.try_send(&lines, Options::default()).0.unwrap_err() {
        SendError::Refused {
            line: 20,
            message: None,
            ..
        } => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn answers_meant_for_an_earlier_client_acknowledge_nothing() {
    let lines = program(20);
    let stand_in = StandIn {
        stale: "ok\r\nerror:1\r\n<Run|MPos:0,0,0>\r\nok\r\n",
        ..StandIn::default()
    };
    let (result, seen) = stand_in.try_send(&lines, Options::default());
    assert_eq!(result.unwrap().lines, 20);
    assert_eq!(seen.lines, lines);
}

#[test]
fn a_program_stop_waits_for_a_person_or_is_passed_by_auto_start() {
    let lines = program(20);
    let stand_in = StandIn {
        hold_after: Some(7),
        ..StandIn::default()
    };
    let options = Options {
        auto_start: true,
        ..Options::default()
    };
    assert_eq!(
        stand_in.clone().try_send(&lines, options).0.unwrap().lines,
        20
    );

    let (port, stop, thread) = stand_in.start();
    let give_up = AtomicBool::new(false);
    let bytes: Vec<&[u8]> = lines.iter().map(|l| l.as_bytes()).collect();
    let mut holds = 0;
    let mut notify = |notice: Notice<'_>| {
        holds += usize::from(notice == Notice::State("Hold"));
        give_up.store(holds >= 3, Ordering::Relaxed);
    };
    let result = stream(
        port,
        &bytes,
        Options {
            auto_start: false,
            stop: Some(&give_up),
            ..Options::default()
        },
        &mut notify,
    );
    stop.store(true, Ordering::Relaxed);
    assert!(
        matches!(result, Err(SendError::Interrupted { line: 8 })),
        "{result:?}"
    );
    assert_eq!(
        thread.join().unwrap().holds,
        1,
        "interruption stops the machine"
    );
}

#[test]
fn trouble_is_told_apart() {
    let lines = program(20);
    let fails = |stand_in: StandIn| {
        stand_in
            .try_send(&lines, Options::default())
            .0
            .unwrap_err()
            .to_string()
    };
    let normal = StandIn::default();
    assert_eq!(
        fails(StandIn {
            state: "Alarm",
            ..normal.clone()
        }),
        "controller is not ready: its state is Alarm"
    );
    assert_eq!(
        fails(StandIn {
            instead: Some((4, "ALARM:2\r\n")),
            ..normal.clone()
        }),
        "ALARM:2 at or before line 4"
    );
    assert_eq!(
        fails(StandIn {
            instead: Some((4, "\r\nGrbl 1.1h ['$' for help]\r\n")),
            ..normal.clone()
        }),
        "controller restarted at or before line 4"
    );
    assert_eq!(
        fails(StandIn {
            receive_buffer: 40,
            ..normal.clone()
        }),
        "line 7 takes 47 bytes, the receive buffer holds 40"
    );
    assert_eq!(
        fails(StandIn {
            dies_after: Some(4),
            ..normal.clone()
        }),
        "controller silent for 5 s at line 5"
    );
    assert_eq!(
        fails(StandIn {
            reports: false,
            ..normal
        }),
        "no answer from the controller within 5 s"
    );
}

#[test]
fn the_preamble_goes_first_and_is_no_line_of_the_program() {
    let lines = program(10);
    let options = Options {
        preamble: Some("$DIALECT FANUC"),
        ..Options::default()
    };
    let (result, seen) = StandIn::default().try_send(&lines, options);
    assert_eq!(result.unwrap().lines, 10);
    assert_eq!(seen.lines[0], "$DIALECT FANUC");
    assert_eq!(seen.lines[1..], lines);
    // Line numbers of refusals count from the program.
    for (bad, expected) in [(1, 0), (4, 3)] {
        let stand_in = StandIn {
            refuse: Some((bad, "", "")),
            ..StandIn::default()
        };
        let (result, seen) = stand_in.try_send(&lines, options);
        let Err(SendError::Refused { line, .. }) = result else {
            panic!("{result:?}");
        };
        assert_eq!(line, expected);
        assert!(bad > 1 || seen.lines.len() == 1);
    }
}
