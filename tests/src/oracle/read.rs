//! A small reader of program text, independent of the core's: good programs only, and only what moves.

/// Axes by letter, in the order of the machine.
pub const LETTERS: [char; 5] = ['X', 'Y', 'Z', 'A', 'C'];

/// Coordinates in 1e-6 mm or degree.
pub type Target = [i64; 5];

/// Which spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Akima.
    A,
    /// Control points.
    B,
    /// Cubic.
    C,
}

/// Condition at an end of a spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// `BAUTO`, `EAUTO`
    Auto,
    /// `BNAT`, `ENAT`
    Natural,
    /// `BTAN`, `ETAN`
    Tangent,
}

/// How a block moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// `G0`
    Rapid,
    /// `G1`
    Linear,
    /// A point of a spline.
    Spline {
        /// Which.
        kind: Kind,
        /// Conditions in force.
        ends: [End; 2],
        /// `SD`
        degree: usize,
        /// `PL`, 1 unless given.
        interval: f64,
    },
    /// `G6`: I in mm, and K3 K2 K1 per axis.
    Cubic(f64, [[f64; 3]; 5]),
}

/// One thing a program does.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Motion.
    Block {
        /// Physical line, from 1.
        line: u32,
        /// How.
        motion: Motion,
        /// Where to.
        target: Target,
        /// Programmed feed, mm/s.
        feed: f64,
        /// `G9`, `G60`
        stop: bool,
        /// `SOFT`
        soft: bool,
    },
    /// A function that acts at standstill.
    Standstill,
}

enum Word {
    Name(String),
    Value(char, String),
}

/// Splits a line into words; keywords take precedence over letters.
fn words(line: &str) -> Vec<Word> {
    const NAMES: [&str; 14] = [
        "ASPLINE", "BSPLINE", "CSPLINE", "BAUTO", "EAUTO", "BNAT", "ENAT", "BTAN", "ETAN", "SOFT",
        "BRISK", "PL", "PW", "SD",
    ];
    let mut rest = line.to_ascii_uppercase();
    if let Some(at) = rest.find(';') {
        rest.truncate(at);
    }
    while let (Some(open), Some(close)) = (rest.find('('), rest.find(')')) {
        rest.replace_range(open..=close, " ");
    }
    let mut rest = rest.trim();
    let mut out = Vec::new();
    if rest.starts_with('%') {
        return out;
    }
    while let Some(first) = rest.chars().next() {
        let number = |text: &str| -> usize {
            // An exponent belongs to the number if digits come before and after it.
            text.char_indices()
                .take_while(|&(_, c)| c.is_ascii_digit() || "+-.E".contains(c))
                .count()
        };
        if let Some(name) = NAMES.iter().find(|name| rest.starts_with(**name)) {
            rest = &rest[name.len()..];
            match *name {
                "PL" | "PW" | "SD" => {
                    rest = rest.strip_prefix('=').unwrap_or(rest);
                    let len = number(rest);
                    // Two letters of their own, so that they meet no address.
                    let letter = if *name == "PL" { 'l' } else { 'w' };
                    let letter = if *name == "SD" { 'd' } else { letter };
                    out.push(Word::Value(letter, rest[..len].into()));
                    rest = &rest[len..];
                }
                _ => out.push(Word::Name((*name).into())),
            }
        } else if let Some(tool) = rest.strip_prefix("T=\"") {
            rest = tool.split_once('"').map_or("", |(_, rest)| rest);
        } else {
            rest = &rest[1..];
            let len = number(rest);
            out.push(Word::Value(first, rest[..len].into()));
            rest = &rest[len..];
        }
        rest = rest.trim_start();
    }
    out
}

/// A printed decimal in units of 1e-6, rounded once.
fn micro(text: &str) -> i64 {
    let value: f64 = text.parse().unwrap_or_else(|_| panic!("number {text:?}"));
    (value * 1e6).round() as i64
}

/// Modal state.
struct Modal {
    mode: Motion,
    ends: [End; 2],
    degree: usize,
    absolute: bool,
    inch: bool,
    stop: bool,
    soft: bool,
    feed: f64,
}

/// Everything `text` does, for a machine that is jerk-limited at power-up.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn blocks(text: &str) -> Vec<Item> {
    let spline = |kind| Motion::Spline {
        kind,
        ends: [End::Natural; 2],
        degree: 3,
        interval: 1.0,
    };
    let mut modal = Modal {
        mode: Motion::Linear,
        ends: [End::Natural; 2],
        degree: 3,
        absolute: true,
        inch: false,
        stop: false,
        soft: true,
        feed: 0.0,
    };
    let mut at: Target = [0; 5];
    let mut out = Vec::new();
    // A G6 block in progress: target, I, axes named, K words.
    let mut cubic: Option<(Target, f64, Vec<usize>, Vec<f64>)> = None;
    for (line, text) in (1..).zip(text.lines()) {
        let mut target = at;
        let mut axes = Vec::new();
        let (mut interval, mut length, mut once) = (1.0, 0.0, false);
        let (mut before, mut after, mut dwell) = (false, false, false);
        let mut feed = None;
        let mut given = Vec::new();
        for word in words(text) {
            let (letter, value) = match word {
                Word::Name(name) => {
                    let end = |name: &str| match &name[1..] {
                        "AUTO" => End::Auto,
                        "NAT" => End::Natural,
                        _ => End::Tangent,
                    };
                    match name.as_str() {
                        "SOFT" => modal.soft = true,
                        "BRISK" => modal.soft = false,
                        "ASPLINE" => modal.mode = spline(Kind::A),
                        "BSPLINE" => {
                            modal.mode = spline(Kind::B);
                            modal.degree = 3;
                        }
                        "CSPLINE" => modal.mode = spline(Kind::C),
                        name if name.starts_with('B') => modal.ends[0] = end(name),
                        name => modal.ends[1] = end(name),
                    }
                    continue;
                }
                Word::Value(letter, value) => (letter, value),
            };
            let number = || -> f64 { value.parse().unwrap_or(0.0) };
            match letter {
                'G' => match number() as u32 {
                    0 => modal.mode = Motion::Rapid,
                    1 => modal.mode = Motion::Linear,
                    4 => dwell = true,
                    6 => modal.mode = Motion::Cubic(0.0, [[0.0; 3]; 5]),
                    9 => once = true,
                    60 => modal.stop = true,
                    64 => modal.stop = false,
                    70 => modal.inch = true,
                    71 => modal.inch = false,
                    90 => modal.absolute = true,
                    91 => modal.absolute = false,
                    _ => {}
                },
                'M' => match number() as u32 {
                    3 | 4 | 6 | 8 => before = true,
                    17 => {}
                    _ => after = true,
                },
                'F' => feed = Some(number()),
                'I' => length = number(),
                'l' => interval = number(),
                'd' => modal.degree = number() as usize,
                'K' => {
                    if let Some((.., k)) = &mut cubic {
                        k.push(number());
                    }
                }
                letter => {
                    if let Some(axis) = LETTERS.iter().position(|l| *l == letter) {
                        given.push((axis, value));
                        axes.push(axis);
                    }
                }
            }
        }
        for (axis, value) in given {
            let unit = if modal.inch && axis < 3 { 25.4 } else { 1.0 };
            let nano = (micro(&value) as f64 * unit).round() as i64;
            target[axis] = if modal.absolute {
                nano
            } else {
                at[axis] + nano
            };
        }
        if let (Some(feed), false) = (feed, dwell) {
            let unit = if modal.inch { 25.4 } else { 1.0 };
            modal.feed = feed * unit / 60.0;
        }
        if before || dwell {
            out.push(Item::Standstill);
        }
        let mut motion = (!axes.is_empty() && !dwell).then(|| modal.mode.clone());
        match &mut motion {
            Some(Motion::Spline {
                ends,
                degree,
                interval: pl,
                ..
            }) => {
                *ends = modal.ends;
                *degree = modal.degree;
                *pl = interval;
            }
            Some(Motion::Cubic(..)) => {
                cubic = Some((target, length, axes, Vec::new()));
                motion = None;
            }
            _ => {}
        }
        if cubic
            .as_ref()
            .is_some_and(|(_, _, axes, k)| k.len() == 3 * axes.len())
        {
            let (end, length, axes, k) = cubic.take().expect("just seen");
            let mut triples = [[0.0; 3]; 5];
            for (axis, triple) in axes.iter().zip(k.chunks(3)) {
                triples[*axis].copy_from_slice(triple);
            }
            target = end;
            motion = Some(Motion::Cubic(length, triples));
        }
        if let Some(motion) = motion {
            at = target;
            out.push(Item::Block {
                line,
                motion,
                target,
                feed: modal.feed,
                stop: once || modal.stop,
                soft: modal.soft,
            });
        }
        if after {
            out.push(Item::Standstill);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glued_and_spaced_spellings_read_alike() {
        let glued = blocks(
            "n10g54g90g64soft\nn20 g1x1.5y2.5f1500\nN30BNATENAT\nN40CSPLINEX6.Y5\nx.5e1 y-2",
        );
        let spaced = blocks("G90 G64 SOFT\nG1 X1.5 Y2.5 F1500\nBNAT ENAT\nCSPLINE X6 Y5\nX5 Y-2");
        assert_eq!(glued, spaced);
        assert_eq!(glued.len(), 3);
    }

    #[test]
    fn inch_and_incremental_add_up() {
        let items = blocks("G1 X1 F60\nG91 X0.5\nG70 X1 A1\nM5");
        let ends: Vec<_> = items
            .iter()
            .filter_map(|item| match item {
                Item::Block { target, .. } => Some(*target),
                Item::Standstill => None,
            })
            .collect();
        let x = |x: i64, a: i64| [x, 0, 0, a, 0];
        assert_eq!(
            ends,
            [x(1_000_000, 0), x(1_500_000, 0), x(26_900_000, 1_000_000)]
        );
        assert_eq!(items.last(), Some(&Item::Standstill));
    }
}
