//! Event files: `tick,event` rows in, requests at exact ticks of the motion out.
//!
//! Rows are `tick,event` with `event` one of `hold`, `resume`, `reset`, `override=PERCENT`, `rapid=PERCENT`,
//! `starve=TICKS`; a first row `tick,event` and lines that start with `#` are skipped. Rows may come in any order; those
//! of one tick act in the order given. `tick` is the clock of [`pentaspline::machine::timetable`].

use std::path::Path;
use std::sync::Arc;

use csv::{ReaderBuilder, StringRecord, Trim};
use pentaspline::machine::timetable::Row;
use pentaspline::machine::Event;
use pentaspline::planner::tempo::{FEED_MAX, RAPID_MAX};
use pentaspline::units::Tick;

use crate::diagnostics::{Exit, Failure, Located};

/// Reads an event file.
///
/// # Errors
/// Exit code 5 if it cannot be read, 2 with the place in the file if a row is not understood.
pub fn load(path: &Path) -> Result<Vec<Row>, Failure> {
    let text =
        std::fs::read_to_string(path).map_err(|e| Failure::io("read event file", path, &e))?;
    parse(&path.display().to_string(), &text)
}

/// Takes the text of an event file, in order of ticks; `file` is its name in errors.
///
/// # Errors
/// Exit code 2 with the place in the file.
pub fn parse(file: &str, text: &str) -> Result<Vec<Row>, Failure> {
    let source: Arc<str> = Arc::from(text);
    let refuse = |(offset, len): (usize, usize), message: &str, label: &str| {
        Failure::new(
            Exit::Usage,
            Located::new(message).at(file, &source, offset, len.max(1), label),
        )
    };
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .quoting(false)
        .trim(Trim::All)
        .from_reader(text.as_bytes());
    let mut rows = Vec::new();
    let mut record = StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            // All that a reader of text in memory, with rows of any length, can complain about is not the text.
            Err(error) => return Err(refuse((0, 1), &error.to_string(), "here")),
        }
        let begin = record.position().map_or(0, |place| place.byte() as usize);
        let line = line_at(text, begin);
        if record.len() == 1 && record[0].is_empty() {
            continue;
        }
        let [tick, event] = [record.get(0), record.get(1)].map(Option::unwrap_or_default);
        if record.len() < 2 {
            return Err(refuse(line, "not an event row", "expected tick,event"));
        }
        if rows.is_empty() && tick == "tick" && event == "event" {
            continue;
        }
        let Ok(tick) = tick.parse::<Tick>() else {
            let place = (line.0, tick.len());
            let expected = "expected a whole number from 0";
            return Err(refuse(place, "not a tick number", expected));
        };
        // What stands behind a second comma is no event either.
        let end = line.0 + line.1;
        let event = match record.len() {
            2 => parse_event(event),
            _ => Err(("unknown event", EVENTS)),
        };
        let event = event.map_err(|(message, expected)| {
            let comma = text[line.0..end].find(',').map_or(0, |at| at + 1);
            let rest = &text[line.0 + comma..end];
            let place = end - rest.trim_start().len();
            refuse((place, end - place), message, expected)
        })?;
        rows.push(Row { tick, event });
    }
    rows.sort_by_key(|row| row.tick);
    Ok(rows)
}

/// Place and length of the first line from `begin` on that is not empty, without the blanks around it.
fn line_at(text: &str, begin: usize) -> (usize, usize) {
    let rest = &text[begin..];
    let start = begin + (rest.len() - rest.trim_start().len());
    let line = text[start..].lines().next().unwrap_or_default();
    (start, line.trim_end().len())
}

/// The events there are.
const EVENTS: &str =
    "expected hold, resume, reset, override=PERCENT, rapid=PERCENT or starve=TICKS";

fn parse_event(text: &str) -> Result<Event, (&'static str, &'static str)> {
    let (name, value) = match text.split_once('=') {
        Some((name, value)) => (name.trim_end(), Some(value.trim_start())),
        None => (text, None),
    };
    let number = |most: u32| {
        let parsed = value.and_then(|value| value.parse::<u32>().ok());
        parsed.filter(|&number| number <= most)
    };
    let percent = |most: u8| number(most.into()).map(|percent| percent as u8);
    match (name, value) {
        ("hold", None) => Ok(Event::Hold),
        ("resume", None) => Ok(Event::Resume),
        ("reset", None) => Ok(Event::Reset),
        ("override", Some(_)) => percent(FEED_MAX)
            .map(Event::Feed)
            .ok_or(("not an override", "expected a whole number from 0 to 200")),
        ("rapid", Some(_)) => percent(RAPID_MAX)
            .map(Event::Rapid)
            .ok_or(("not an override", "expected a whole number from 0 to 100")),
        ("starve", Some(_)) => number(u32::MAX / 4)
            .map(Event::Starve)
            .ok_or(("not a number of ticks", "expected a whole number from 0")),
        _ => Err(("unknown event", EVENTS)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_out_by_tick_and_in_order_within_one() {
        let events = parse(
            "e",
            "tick,event\r\n# a comment\n900, resume\n\n30,hold\n900,hold\n5000000000,reset\n 7 , override = 130 \n8,rapid=25\n9,starve=4000",
        )
        .unwrap();
        let flat: Vec<(Tick, Event)> = events.iter().map(|e| (e.tick, e.event)).collect();
        let expected = [
            (7, Event::Feed(130)),
            (8, Event::Rapid(25)),
            (9, Event::Starve(4000)),
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
            ("1,override=201\n", "e.csv:1:3", "not an override"),
            ("1, rapid=101\n", "e.csv:1:4", "not an override"),
            ("1,override\n", "e.csv:1:3", "unknown event"),
            ("1,starve=-1\n", "e.csv:1:3", "not a number of ticks"),
            ("1,hold=2\n", "e.csv:1:3", "unknown event"),
        ] {
            let failure = parse("e.csv", text).unwrap_err();
            assert_eq!(failure.exit, Exit::Usage);
            let shown = failure.render();
            assert!(shown.contains(place) && shown.contains(message), "{shown}");
        }
    }
}
