//! Lines to words: addresses with their text, keywords, and the forms with brackets. Good programs only.

/// One word of a line.
#[derive(Clone, Debug, PartialEq)]
pub enum Word {
    /// Keyword without a value.
    Name(&'static str),
    /// Letter or keyword with a number: `X1.5`, `PL=2`, `CR=-4`.
    Value(String, f64),
    /// `X=AC(5)`, `XIC5`: address, `true` for incremental, number.
    Sized(char, bool, f64),
    /// `PO[X]=(10,2,1)`; ` ` for the denominator.
    Polynomial(char, Vec<f64>),
    /// `POX`, `POD`: the axis the following `Q` words belong to; ` ` for the denominator.
    Preparation(char),
    /// `SPLINEPATH`: letters.
    Path(String),
}

/// Keywords with a number.
const VALUED: [&str; 8] = ["PL", "PW", "SD", "CR", "TURN", "XH", "YH", "ZH"];
/// Keywords alone.
const NAMES: [&str; 18] = [
    "ASPLINE", "BSPLINE", "CSPLINE", "BAUTO", "EAUTO", "BNAT", "ENAT", "BTAN", "ETAN", "SOFT",
    "BRISK", "POLY", "CFTCP", "CFC", "CFIN", "FNORM", "NORM", "MSG",
];

/// Bytes of the number `text` begins with. An exponent belongs to it if digits follow.
fn number(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut len = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    while bytes
        .get(len)
        .is_some_and(|b| b.is_ascii_digit() || *b == b'.')
    {
        len += 1;
    }
    if bytes.get(len) == Some(&b'E') {
        let sign = usize::from(matches!(bytes.get(len + 1), Some(b'+' | b'-')));
        let digits = bytes[len + 1 + sign..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count();
        if digits > 0 {
            len += 1 + sign + digits;
        }
    }
    len
}

/// Takes the number off the front of `rest`; 0 if there is none.
fn value(rest: &mut &str) -> f64 {
    *rest = rest.trim_start();
    *rest = rest.strip_prefix('=').unwrap_or(rest).trim_start();
    let len = number(rest);
    let parsed = rest[..len].parse().unwrap_or(0.0);
    *rest = &rest[len..];
    parsed
}

/// Takes `( .. )` off the front.
fn brackets<'a>(rest: &mut &'a str) -> &'a str {
    let (inside, behind) = rest[1..].split_once(')').unwrap_or((&rest[1..], ""));
    *rest = behind;
    inside
}

/// The words of `line`.
///
/// # Panics
/// On what no good program holds.
#[must_use]
pub fn words(line: &str) -> Vec<Word> {
    let upper = line.to_ascii_uppercase();
    let mut rest = upper.split(';').next().unwrap_or("").trim();
    let mut out = Vec::new();
    if rest.starts_with('%') {
        return out;
    }
    rest = rest.strip_prefix('/').unwrap_or(rest);
    while let Some(first) = rest.chars().next() {
        let keyword = |list: &[&'static str]| {
            list.iter()
                .copied()
                .filter(|name| rest.starts_with(name))
                .max_by_key(|name| name.len())
        };
        if first == '(' {
            brackets(&mut rest);
        } else if let Some(behind) = rest.strip_prefix("SPLINEPATH") {
            rest = behind.trim_start();
            let letters = if rest.starts_with('(') {
                brackets(&mut rest).to_owned()
            } else {
                std::mem::take(&mut rest).to_owned()
            };
            let letters = letters.chars().filter(char::is_ascii_alphabetic).collect();
            out.push(Word::Path(letters));
        } else if let Some(behind) = rest.strip_prefix("PO[") {
            let (axis, behind) = behind.split_once(']').expect("PO[..]");
            rest = behind
                .trim_start()
                .strip_prefix('=')
                .unwrap_or(behind)
                .trim_start();
            let numbers = brackets(&mut rest).split(',');
            let numbers = numbers.map(|n| n.trim().parse().unwrap_or(0.0)).collect();
            out.push(Word::Polynomial(
                axis.trim().chars().next().unwrap_or(' '),
                numbers,
            ));
        } else if let Some(behind) = rest.strip_prefix("PO").filter(|b| !b.starts_with('L')) {
            let axis = behind.chars().next().expect("an axis");
            rest = &behind[1..];
            out.push(Word::Preparation(if axis == 'D' { ' ' } else { axis }));
        } else if let Some(name) = keyword(&VALUED) {
            rest = &rest[name.len()..];
            out.push(Word::Value(name.into(), value(&mut rest)));
        } else if let Some(name) = keyword(&NAMES) {
            rest = rest[name.len()..].trim_start();
            if name == "MSG" && rest.starts_with('(') {
                brackets(&mut rest);
            }
            out.push(Word::Name(name));
        } else if let Some(tool) = rest.strip_prefix("T=\"") {
            rest = tool.split_once('"').map_or("", |(_, rest)| rest);
        } else {
            rest = rest[first.len_utf8()..].trim_start();
            rest = rest.strip_prefix('=').unwrap_or(rest).trim_start();
            let sized = ["AC", "IC", "DC"]
                .iter()
                .find(|name| rest.starts_with(**name));
            // `A` and `C` are axes, too: only a number or a bracket makes it a dimension.
            let dimension = sized.filter(|_| {
                rest[2..].starts_with(|c: char| c == '(' || c.is_ascii_digit() || "+-.".contains(c))
            });
            if let Some(name) = dimension {
                rest = &rest[2..];
                let number = if rest.starts_with('(') {
                    brackets(&mut rest).trim().parse().unwrap_or(0.0)
                } else {
                    value(&mut rest)
                };
                out.push(Word::Sized(first, *name == "IC", number));
            } else {
                out.push(Word::Value(first.into(), value(&mut rest)));
            }
        }
        rest = rest.trim_start();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_spellings_give_the_same_words() {
        let same = |a: &str, b: &str| assert_eq!(words(a), words(b), "{a} / {b}");
        same("X=AC(5) Y=IC(-2.5) I=AC(3)", "XAC5YIC-2.5IAC3");
        same("G2 X1 CR=-4 TURN=2", "g2x1cr-4turn2");
        same("SPLINEPATH(1,X,Y)", "SPLINEPATH XY");
        same("A1C2", "A=1 C=2 (comment)");
        assert_eq!(
            words("PO[X]=(10,2,-1.5) PL=4"),
            [
                Word::Polynomial('X', vec![10.0, 2.0, -1.5]),
                Word::Value("PL".into(), 4.0)
            ]
        );
        assert_eq!(words("POD Q2")[0], Word::Preparation(' '));
    }
}
