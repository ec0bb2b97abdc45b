//! Event files: `tick,event` rows in, requests at exact servo ticks out.
//!
//! Rows are `tick,event` with `event` one of `hold`, `resume`, `reset`; a first row `tick,event` and lines
//! that start with `#` are skipped. Rows may come in any order; those of one tick act in the order given.

use std::path::Path;
use std::sync::Arc;

use pentaspline::machine::Event;
use pentaspline::units::Tick;

use crate::diagnostics::{Exit, Failure, Located};

/// A request at a servo tick: it acts before the tick is calculated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedEvent {
    /// Servo tick, 0 is the first.
    pub tick: Tick,
    /// What happens.
    pub event: Event,
}

/// Reads an event file.
///
/// # Errors
/// Exit code 5 if it cannot be read, 2 with the place in the file if a row is not understood.
pub fn load(path: &Path) -> Result<Vec<TimedEvent>, Failure> {
    let text =
        std::fs::read_to_string(path).map_err(|e| Failure::io("read event file", path, &e))?;
    parse(&path.display().to_string(), &text)
}

/// Takes the text of an event file, in order of ticks; `file` is its name in errors.
///
/// # Errors
/// Exit code 2 with the place in the file.
pub fn parse(file: &str, text: &str) -> Result<Vec<TimedEvent>, Failure> {
    let source: Arc<str> = Arc::from(text);
    let refuse = |offset: usize, len: usize, message: &str, label: &str| {
        Failure::new(
            Exit::Usage,
            Located::new(message).at(file, &source, offset, len, label),
        )
    };
    let mut events = Vec::new();
    let mut offset = 0;
    for (index, line) in text.split_inclusive('\n').enumerate() {
        let start = offset;
        offset += line.len();
        let row = line.trim();
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let at = start + (line.len() - line.trim_start().len());
        let Some((tick, event)) = row.split_once(',') else {
            return Err(refuse(
                at,
                row.len(),
                "not an event row",
                "expected tick,event",
            ));
        };
        let (tick, name) = (tick.trim(), event.trim());
        if index == 0 && tick == "tick" && name == "event" {
            continue;
        }
        let Ok(tick) = tick.parse::<Tick>() else {
            return Err(refuse(
                at,
                tick.len().max(1),
                "not a tick number",
                "expected a whole number from 0",
            ));
        };
        let event = match name {
            "hold" => Event::Hold,
            "resume" => Event::Resume,
            "reset" => Event::Reset,
            _ => {
                let place = at + row.len() - name.len();
                return Err(refuse(
                    place,
                    name.len().max(1),
                    "unknown event",
                    "expected hold, resume or reset",
                ));
            }
        };
        events.push(TimedEvent { tick, event });
    }
    events.sort_by_key(|event| event.tick);
    Ok(events)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_out_by_tick_and_in_order_within_one() {
        let events = parse(
            "e",
            "tick,event\r\n# a comment\n900, resume\n\n30,hold\n900,hold\n5000000000,reset",
        )
        .unwrap();
        let flat: Vec<(Tick, Event)> = events.iter().map(|e| (e.tick, e.event)).collect();
        let expected = [
            (30, Event::Hold),
            (900, Event::Resume),
            (900, Event::Hold),
            (5_000_000_000, Event::Reset),
        ];
        assert_eq!(flat, expected);
        assert_eq!(parse("e", "").unwrap(), []);
    }

    #[test]
    fn a_row_that_is_not_understood_is_shown() {
        for (text, place, message) in [
            ("1,hold\n2,jump\n", "e.csv:2:3", "unknown event"),
            ("1,hold\nx,hold\n", "e.csv:2:1", "not a tick number"),
            ("-1,hold\n", "e.csv:1:1", "not a tick number"),
            ("1,hold\n\n  7\n", "e.csv:3:3", "not an event row"),
            ("1,hold,2\n", "e.csv:1:3", "unknown event"),
            ("1,\n", "e.csv:1:3", "unknown event"),
        ] {
            let failure = parse("e.csv", text).unwrap_err();
            assert_eq!(failure.exit, Exit::Usage);
            let shown = failure.render();
            assert!(shown.contains(place) && shown.contains(message), "{shown}");
        }
    }
}
