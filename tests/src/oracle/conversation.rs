//! Heidenhain conversational programs: the same items as [`super::read`] gives, from `L`, `CC`, `C`, `CR`, `SPL`.

use super::item::{Item, Motion, Target, LETTERS};
use super::modal::micro;

/// One word: letters with a possible `I` in front, and a number.
type Given = Vec<(String, f64)>;

/// Splits `text` into letters and numbers: `K3X-1.5` is `K3X` and -1.5.
fn words(text: &str) -> Given {
    let mut out = Given::new();
    for token in text.split_whitespace() {
        let mut rest = token;
        while !rest.is_empty() {
            // K1, K2 and K3 belong to the name.
            let name = if rest.starts_with('K') && rest.len() > 2 {
                3
            } else {
                rest.find(|c: char| c.is_ascii_digit() || "+-.".contains(c))
                    .unwrap_or(rest.len())
            };
            let number = rest[name..]
                .find(|c: char| c.is_ascii_alphabetic())
                .map_or(rest.len(), |n| name + n);
            out.push((
                rest[..name].into(),
                rest[name..number].parse().unwrap_or(0.0),
            ));
            rest = &rest[number..];
        }
    }
    out
}

/// Everything a conversational program does.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn blocks(text: &str) -> Vec<Item> {
    let mut at: Target = [0; 5];
    let mut centre = [0_i64; 3];
    let mut plane = [0, 1];
    let mut feed = 0.0;
    let mut out = Vec::new();
    // A spline block whose coefficients have not all come.
    let mut spline: Option<(Target, Vec<usize>, Given)> = None;
    for (line, text) in (1..).zip(text.lines()) {
        let upper = text.to_ascii_uppercase();
        let text = upper.split(';').next().unwrap_or("").trim();
        let text = text
            .trim_start_matches(|c: char| c.is_ascii_digit())
            .trim_start();
        let (verb, rest) = text
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((text, ""));
        let given = words(rest);
        let value = |key: &str| given.iter().find(|(k, _)| k == key).map(|(_, v)| *v);
        let mut target = at;
        let mut axes = Vec::new();
        for (key, number) in &given {
            for (axis, letter) in LETTERS.iter().enumerate() {
                if *key == letter.to_string() {
                    target[axis] = micro(*number);
                    axes.push(axis);
                } else if *key == format!("I{letter}") {
                    target[axis] = at[axis] + micro(*number);
                    axes.push(axis);
                }
            }
        }
        if let Some(f) = value("F").filter(|f| *f > 0.0) {
            feed = f / 60.0;
        }
        let turn = given.iter().find(|(k, _)| k == "DR").map(|_| {
            // "DR+" has no digits: the sign is all there is.
            rest.contains("DR-")
        });
        let mut motion = None;
        match verb {
            "STOP" | "END" | "TOOL" => out.push(Item::Standstill),
            "L" if !axes.is_empty() => {
                let rapid = rest.contains("FMAX");
                motion = Some(if rapid { Motion::Rapid } else { Motion::Linear });
            }
            "CC" => {
                for &axis in axes.iter().filter(|a| **a < 3) {
                    centre[axis] = target[axis];
                }
                if axes.len() == 2 {
                    axes.sort_unstable();
                    plane = if axes == [0, 2] {
                        [2, 0]
                    } else {
                        [axes[0], axes[1]]
                    };
                }
            }
            "C" => {
                motion = Some(Motion::Arc {
                    plane,
                    clockwise: turn.unwrap_or(false),
                    centre: Ok(plane.map(|a| centre[a])),
                    turns: 0,
                });
            }
            "CR" => {
                motion = Some(Motion::Arc {
                    plane: [0, 1],
                    clockwise: turn.unwrap_or(false),
                    centre: Err(value("R").expect("a radius")),
                    turns: 0,
                });
            }
            "SPL" => spline = Some((target, axes.clone(), given.clone())),
            _ => {
                if let Some((.., all)) = &mut spline {
                    all.extend(words(text));
                }
            }
        }
        let complete = spline.as_ref().is_some_and(|(_, axes, all)| {
            all.iter().filter(|(k, _)| k.starts_with('K')).count() == 3 * axes.len()
        });
        if complete {
            let (end, _, all) = spline.take().expect("just seen");
            let mut b = [[0.0; 3]; 5];
            for (axis, letter) in LETTERS.iter().enumerate() {
                for (row, k) in b[axis].iter_mut().zip(["K3", "K2", "K1"]) {
                    let key = format!("{k}{letter}");
                    *row = all.iter().find(|(k, _)| *k == key).map_or(0.0, |(_, v)| *v);
                }
            }
            if let Some((_, f)) = all.iter().find(|(k, f)| k == "F" && *f > 0.0) {
                feed = f / 60.0;
            }
            target = end;
            motion = Some(Motion::Cubic(b));
        }
        if let Some(motion) = motion {
            at = target;
            out.push(Item::Block {
                line,
                motion,
                target,
                feed,
                inverse: false,
                stop: false,
                soft: true,
                anew: true,
            });
        }
        if given.iter().any(|(k, _)| k == "M") && spline.is_none() {
            out.push(Item::Standstill);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_circles_and_splines_are_read() {
        let items = blocks(
            "0 BEGIN PGM A MM\n1 L X+10 Y+5 R0 F600\n2 L IX-2.5 FMAX\n3 CC X+0 Y+5\n4 C X-7.5 Y+5 DR-\n\
             5 SPL X0 Y0 K3X1 K2X2 K1X-10.5\n6 K3Y0 K2Y1 K1Y4\n7 END PGM A MM\n",
        );
        assert_eq!(items.len(), 5);
        let Item::Block {
            motion,
            target,
            feed,
            line,
            ..
        } = &items[3]
        else {
            panic!()
        };
        assert_eq!((*line, *target, *feed), (7, [0; 5], 10.0));
        let mut b = [[0.0; 3]; 5];
        b[0] = [1.0, 2.0, -10.5];
        b[1] = [0.0, 1.0, 4.0];
        assert_eq!(*motion, Motion::Cubic(b));
        let Item::Block {
            motion: Motion::Arc {
                clockwise, centre, ..
            },
            ..
        } = &items[2]
        else {
            panic!()
        };
        assert!(*clockwise);
        assert_eq!(*centre, Ok([0, 5_000_000]));
    }
}
