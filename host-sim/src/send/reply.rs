//! What a controller of the GRBL family answers, line by line.
//!
//! Comes in: one line without its end. Goes out: a [`Reply`] that borrows from it. Nothing is refused: a
//! line that means nothing here is [`Reply::Other`].

/// One line from the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply<'a> {
    /// `ok`: the oldest line in flight has been taken.
    Ok,
    /// `error:N`: the oldest line in flight has been refused. The text behind the colon.
    Error(&'a str),
    /// `ALARM:N`: the machine has stopped. The text behind the colon.
    Alarm(&'a str),
    /// `<State|...>`.
    Status(Status<'a>),
    /// `Grbl ...`: the controller has just started.
    Banner,
    /// `[MSG:text]`.
    Message(&'a str),
    /// Anything else.
    Other(&'a str),
}

/// The fields of a status report that a sender needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status<'a> {
    /// Name of the state without its sub-state: `Hold:0` gives `Hold`.
    pub state: &'a str,
    /// Free bytes of the receive buffer: the second number of `Bf:`.
    pub receive_free: Option<usize>,
}

impl<'a> Reply<'a> {
    /// Reads one line; surrounding white space does not count.
    #[must_use]
    pub fn parse(line: &'a str) -> Self {
        let line = line.trim();
        if line == "ok" {
            Self::Ok
        } else if let Some(code) = line.strip_prefix("error:") {
            Self::Error(code.trim())
        } else if let Some(code) = line.strip_prefix("ALARM:") {
            Self::Alarm(code.trim())
        } else if let Some(text) = line
            .strip_prefix("[MSG:")
            .and_then(|rest| rest.strip_suffix(']'))
        {
            Self::Message(text.trim())
        } else if let Some(fields) = line
            .strip_prefix('<')
            .and_then(|rest| rest.strip_suffix('>'))
        {
            Self::Status(Status::parse(fields))
        } else if line.starts_with("Grbl") {
            Self::Banner
        } else {
            Self::Other(line)
        }
    }
}

impl<'a> Status<'a> {
    fn parse(fields: &'a str) -> Self {
        let mut parts = fields.split('|');
        let state = parts.next().unwrap_or("").split(':').next().unwrap_or("");
        let buffer = parts.find_map(|part| part.strip_prefix("Bf:"));
        let receive_free =
            buffer.and_then(|numbers| numbers.split(',').nth(1)?.trim().parse().ok());
        Self {
            state,
            receive_free,
        }
    }
}

/// Line and column (both from 1) that a message names as `line L column C`, in any case, with or without a
/// comma between; column 1 if only the line is named.
#[must_use]
pub fn place(message: &str) -> Option<(usize, usize)> {
    let lower = message.to_ascii_lowercase();
    let after = |word: &str| {
        let start = lower.find(word)? + word.len();
        let digits = lower[start..].trim_start();
        let end = digits
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(digits.len());
        digits[..end].parse::<usize>().ok()
    };
    Some((after("line ")?, after("column ").unwrap_or(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_report_lines_are_understood() {
        // Forms as printed in the GRBL 1.1 interface description.
        let status = |state, receive_free| {
            Reply::Status(Status {
                state,
                receive_free,
            })
        };
        assert_eq!(Reply::parse("ok\r"), Reply::Ok);
        assert_eq!(Reply::parse("error:20"), Reply::Error("20"));
        assert_eq!(Reply::parse("ALARM:1"), Reply::Alarm("1"));
        assert_eq!(
            Reply::parse("[MSG:'$H'|'$X' to unlock]"),
            Reply::Message("'$H'|'$X' to unlock")
        );
        assert_eq!(Reply::parse("Grbl 1.1h ['$' for help]"), Reply::Banner);
        assert_eq!(
            Reply::parse("<Idle|WPos:0.000,0.000,0.000|Bf:15,128|FS:0.0,0>"),
            status("Idle", Some(128))
        );
        assert_eq!(
            Reply::parse("<Hold:0|MPos:0.000,-10.000,5.000|FS:0,0>"),
            status("Hold", None)
        );
        assert_eq!(Reply::parse("<Idle>"), status("Idle", None));
        assert_eq!(Reply::parse("<>"), status("", None));
        assert_eq!(Reply::parse("<Run|Bf:15>"), status("Run", None));
        assert_eq!(Reply::parse("okay"), Reply::Other("okay"));
        assert_eq!(Reply::parse("[GC:G0 G54]"), Reply::Other("[GC:G0 G54]"));
    }

    #[test]
    fn a_message_may_name_the_place() {
        assert_eq!(place("line 12 column 7: unknown word"), Some((12, 7)));
        assert_eq!(place("Line 3, column 14"), Some((3, 14)));
        assert_eq!(place("at line 5"), Some((5, 1)));
        assert_eq!(place("line x"), None);
        assert_eq!(place("line 99999999999999999999999"), None);
    }
}
