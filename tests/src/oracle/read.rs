//! A small reader of program text, independent of the core's: good programs only, and only what moves.
//!
//! Sinumerik and Fanuc are read here, Heidenhain in [`super::conversation`]. No parameters, jumps or sub-programs.

use super::conversation;
pub use super::item::{End, Item, Kind, Language, Motion, Setup, Target, LETTERS};
use super::modal::{micro, Modal, Mode, Nurbs, Printed};
use super::words::{words, Word};

/// Everything `text` does on a plain machine that is jerk-limited at power-up.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn blocks(text: &str) -> Vec<Item> {
    blocks_on(&Setup::default(), text)
}

/// Everything `text` does on the machine `setup`.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn blocks_on(setup: &Setup, text: &str) -> Vec<Item> {
    if setup.language == Language::Heidenhain {
        return conversation::blocks(text);
    }
    let mut reader = Reader::new(*setup);
    for (line, text) in (1..).zip(text.lines()) {
        reader.line(line, text);
    }
    reader.end_nurbs();
    reader.out
}

struct Reader {
    setup: Setup,
    modal: Modal,
    at: Target,
    out: Vec<Item>,
    printed: Option<Printed>,
    nurbs: Option<Nurbs>,
    /// `POX Q..`, `POD Q..` waiting for their end point.
    prepared: Vec<(char, Vec<f64>)>,
}

impl Reader {
    fn new(setup: Setup) -> Self {
        Self {
            setup,
            modal: Modal::power_up(),
            at: [0; 5],
            out: Vec::new(),
            printed: None,
            nurbs: None,
            prepared: Vec::new(),
        }
    }

    fn select(&mut self, mode: Mode) {
        if mode != Mode::Nurbs {
            self.end_nurbs();
        }
        self.modal.mode = mode;
        self.modal.anew = true;
    }

    fn name(&mut self, name: &str) {
        let end = |name: &str| match &name[1..] {
            "AUTO" => End::Auto,
            "NAT" => End::Natural,
            _ => End::Tangent,
        };
        match name {
            "SOFT" => self.modal.soft = true,
            "BRISK" => self.modal.soft = false,
            "ASPLINE" => self.select(Mode::Spline(Kind::A)),
            "BSPLINE" => {
                self.modal.degree = 3;
                self.select(Mode::Spline(Kind::B));
            }
            "CSPLINE" => self.select(Mode::Spline(Kind::C)),
            "POLY" => self.select(Mode::Polynomial),
            "BAUTO" | "BNAT" | "BTAN" => self.modal.ends[0] = end(name),
            "EAUTO" | "ENAT" | "ETAN" => self.modal.ends[1] = end(name),
            _ => {}
        }
    }

    /// A G function; the flags are those of the line: exact stop, dwell, machine coordinates.
    fn g(&mut self, number: f64, once: &mut bool, dwell: &mut bool, machine: &mut bool) {
        let modal = &mut self.modal;
        match (number * 10.0).round() as u32 {
            0 => self.select(Mode::Rapid),
            10 => self.select(Mode::Linear),
            20 => self.select(Mode::Arc(true)),
            30 => self.select(Mode::Arc(false)),
            40 => *dwell = true,
            60 => self.select(Mode::Cubic),
            62 => self.select(Mode::Nurbs),
            90 => *once = true,
            170 => modal.plane = [0, 1, 2],
            180 => modal.plane = [2, 0, 1],
            190 => modal.plane = [1, 2, 0],
            530 => *machine = true,
            540..=570 => modal.frame = Some(number as usize - 54),
            5000 => modal.frame = None,
            600 => modal.stop = true,
            640 => modal.stop = false,
            700 | 7000 => modal.inch = true,
            710 | 7100 => modal.inch = false,
            900 => modal.absolute = true,
            910 => modal.absolute = false,
            930 => (modal.inverse, modal.per_turn) = (true, false),
            940 => (modal.inverse, modal.per_turn) = (false, false),
            950 => (modal.inverse, modal.per_turn) = (false, true),
            _ => {}
        }
    }

    fn line(&mut self, line: u32, text: &str) {
        let words = words(text);
        let (mut once, mut dwell, mut machine) = (false, false, false);
        let (mut before, mut after) = (false, false);
        // Addresses in the order of the line: letter, dimension (incremental or not), number.
        let mut given: Vec<(String, Option<bool>, f64)> = Vec::new();
        let mut polynomials = Vec::new();
        for word in words {
            match word {
                Word::Name(name) => self.name(name),
                Word::Value(key, value) => match key.as_str() {
                    "G" => self.g(value, &mut once, &mut dwell, &mut machine),
                    "M" => match value as u32 {
                        3 | 4 | 6 | 8 | 7 => before = true,
                        17 | 40..=45 => {}
                        _ => after = true,
                    },
                    "N" | "T" | "D" => {}
                    "S" => self.modal.speed = value,
                    "SD" => self.modal.degree = value as usize,
                    "Q" => {
                        if let Some((_, numbers)) = self.prepared.last_mut() {
                            numbers.push(value);
                        }
                    }
                    _ => given.push((key, None, value)),
                },
                Word::Sized(letter, incremental, value) => {
                    given.push((letter.into(), Some(incremental), value));
                }
                Word::Polynomial(axis, numbers) => polynomials.push((axis, numbers)),
                Word::Preparation(axis) => self.prepared.push((axis, Vec::new())),
                Word::Path(letters) => {
                    self.modal.axes = LETTERS.map(|l| letters.is_empty() || letters.contains(l));
                }
            }
        }
        let value = |key: &str| given.iter().find(|(k, ..)| k == key).map(|(.., v)| *v);
        if let (Some(feed), false) = (value("F"), dwell) {
            let unit = if self.modal.inch && !self.modal.inverse {
                25.4
            } else {
                1.0
            };
            let turns = if self.modal.per_turn {
                self.modal.speed
            } else {
                1.0
            };
            self.modal.feed = feed * unit * turns / 60.0;
        }
        if before || dwell {
            self.out.push(Item::Standstill);
        }
        let moved = !dwell && self.act(line, &given, polynomials, once, machine, after);
        if after && !moved {
            self.end_nurbs();
            self.out.push(Item::Standstill);
        }
    }

    /// End point and axes named.
    fn target(
        &self,
        given: &[(String, Option<bool>, f64)],
        polynomials: &[(char, Vec<f64>)],
        machine: bool,
    ) -> (Target, Vec<usize>) {
        let mut target = self.at;
        let mut axes = Vec::new();
        let ends = polynomials
            .iter()
            .filter(|(axis, _)| *axis != ' ')
            .map(|(axis, numbers)| (axis.to_string(), None, numbers[0]));
        for (key, dimension, number) in given.iter().cloned().chain(ends) {
            let mut letters = key.chars();
            let (Some(letter), None) = (letters.next(), letters.next()) else {
                continue;
            };
            let Some(axis) = LETTERS.iter().position(|l| *l == letter) else {
                continue;
            };
            axes.push(axis);
            let unit = if self.modal.inch && axis < 3 {
                25.4
            } else {
                1.0
            };
            let nano = (micro(number) as f64 * unit).round() as i64;
            let incremental = dimension.unwrap_or(!self.modal.absolute);
            target[axis] = if incremental {
                self.at[axis] + nano
            } else if machine {
                nano
            } else {
                nano + self
                    .modal
                    .frame
                    .map_or(0, |frame| self.setup.offsets[frame][axis])
            };
        }
        (target, axes)
    }

    /// Centre of an arc: I J K relative to the start unless `AC`, or the radius.
    fn centre(&self, given: &[(String, Option<bool>, f64)]) -> Result<[i64; 2], f64> {
        if let Some((.., radius)) = given.iter().find(|(key, ..)| key == "CR") {
            let unit = if self.modal.inch { 25.4 } else { 1.0 };
            return Err(radius * unit);
        }
        let unit = if self.modal.inch { 25.4 } else { 1.0 };
        Ok([0, 1].map(|k| {
            let axis = self.modal.plane[k];
            let letter = ["I", "J", "K"][axis];
            let word = given.iter().find(|(key, ..)| key == letter);
            let nano = word.map_or(0, |(.., v)| (micro(*v) as f64 * unit).round() as i64);
            match word {
                Some((_, Some(false), _)) => {
                    nano + self
                        .modal
                        .frame
                        .map_or(0, |frame| self.setup.offsets[frame][axis])
                }
                _ => self.at[axis] + nano,
            }
        }))
    }

    /// The motion of a line, if it has one; `true` if functions behind it are taken care of.
    fn act(
        &mut self,
        line: u32,
        given: &[(String, Option<bool>, f64)],
        mut polynomials: Vec<(char, Vec<f64>)>,
        once: bool,
        machine: bool,
        after: bool,
    ) -> bool {
        let value = |key: &str| given.iter().find(|(k, ..)| k == key).map(|(.., v)| *v);
        if let Some(printed) = &mut self.printed {
            let k = given.iter().filter(|(key, ..)| key == "K");
            printed.k.extend(k.map(|(.., v)| *v));
        }
        let (target, axes) = self.target(given, &polynomials, machine);
        if self.modal.mode == Mode::Nurbs {
            let nurbs = self.nurbs.get_or_insert(Nurbs {
                line,
                order: 4,
                points: Vec::new(),
                weights: Vec::new(),
                knots: Vec::new(),
            });
            nurbs.line = line;
            nurbs.order = value("P").map_or(nurbs.order, |p| p as usize);
            nurbs.knots.extend(value("K"));
            if !axes.is_empty() {
                nurbs.points.push(target);
                nurbs.weights.push(value("R").unwrap_or(1.0));
                self.at = target;
            }
            return false;
        }
        let mut motion = match self.modal.mode {
            _ if axes.is_empty() => None,
            Mode::Rapid => Some(Motion::Rapid),
            Mode::Linear => Some(Motion::Linear),
            Mode::Arc(clockwise) => Some(Motion::Arc {
                plane: [self.modal.plane[0], self.modal.plane[1]],
                clockwise,
                centre: self.centre(given),
                turns: value("TURN").unwrap_or(0.0) as u32,
            }),
            Mode::Spline(kind) => Some(Motion::Spline {
                kind,
                ends: self.modal.ends,
                degree: self.modal.degree,
                interval: value("PL").unwrap_or(1.0),
                weight: value("PW").unwrap_or(1.0),
                axes: self.modal.axes,
            }),
            Mode::Polynomial => {
                let mut all = [None; 5];
                let mut under = [1.0, 0.0, 0.0, 0.0, 0.0];
                for (axis, numbers) in self.prepared.drain(..) {
                    // Preparation words of an axis lack the end point that the bracket form begins with.
                    let skipped = if axis == ' ' { vec![] } else { vec![0.0] };
                    polynomials.push((axis, [skipped, numbers].concat()));
                }
                for (axis, numbers) in &polynomials {
                    if let Some(axis) = LETTERS.iter().position(|l| l == axis) {
                        let number = |k: usize| numbers.get(k + 1).copied().unwrap_or(0.0);
                        all[axis] = Some(core::array::from_fn(number));
                    } else {
                        for (b, n) in under.iter_mut().zip(numbers) {
                            *b = *n;
                        }
                    }
                }
                Some(Motion::Polynomial {
                    length: value("PL").unwrap_or(1.0),
                    axes: all,
                    under,
                    origin: self
                        .modal
                        .frame
                        .map_or([0; 5], |frame| self.setup.offsets[frame]),
                })
            }
            Mode::Cubic => {
                self.printed = Some(Printed {
                    target,
                    length: value("I").unwrap_or(0.0),
                    axes,
                    k: given
                        .iter()
                        .filter(|(key, ..)| key == "K")
                        .map(|(.., v)| *v)
                        .collect(),
                    after,
                });
                None
            }
            Mode::Nurbs => None,
        };
        let (mut target, mut after, mut handled) = (target, after, self.printed.is_some());
        let complete = |p: &Printed| p.k.len() == 3 * p.axes.len();
        if self.printed.as_ref().is_some_and(complete) {
            let printed = self.printed.take().expect("just seen");
            motion = Some(Motion::Cubic(printed.coefficients()));
            (target, after, handled) = (printed.target, printed.after, true);
        }
        if let Some(motion) = motion {
            self.at = target;
            self.out.push(Item::Block {
                line,
                motion,
                target,
                feed: self.modal.feed,
                inverse: self.modal.inverse,
                stop: once || self.modal.stop,
                soft: self.modal.soft,
                anew: std::mem::take(&mut self.modal.anew),
            });
            if handled && after {
                self.out.push(Item::Standstill);
            }
        }
        handled
    }

    /// Hands out a complete `G06.2` curve.
    fn end_nurbs(&mut self) {
        let Some(nurbs) = self.nurbs.take() else {
            return;
        };
        self.out.push(Item::Block {
            line: nurbs.line,
            target: *nurbs.points.last().expect("points"),
            motion: Motion::Nurbs {
                order: nurbs.order,
                points: nurbs.points,
                weights: nurbs.weights,
                knots: nurbs.knots,
            },
            feed: self.modal.feed,
            inverse: self.modal.inverse,
            stop: self.modal.stop,
            soft: self.modal.soft,
            anew: true,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(items: &[Item]) -> Vec<Target> {
        let target = |item: &Item| match item {
            Item::Block { target, .. } => Some(*target),
            Item::Standstill => None,
        };
        items.iter().filter_map(target).collect()
    }

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
        let x = |x: i64, a: i64| [x, 0, 0, a, 0];
        assert_eq!(
            ends(&items),
            [x(1_000_000, 0), x(1_500_000, 0), x(26_900_000, 1_000_000)]
        );
        assert_eq!(items.last(), Some(&Item::Standstill));
    }

    #[test]
    fn frames_shift_absolute_coordinates_only() {
        let setup = Setup {
            offsets: [[1_000_000, 0, 0, 0, 0], [2_000_000; 5], [0; 5], [0; 5]],
            ..Setup::default()
        };
        let text = "G1 F1 X1\nG55 X1\nG91 X1\nG90 X=IC(1)\nX=AC(1)\nG53 X1\nX1\nG500 X1";
        let x: Vec<i64> = ends(&blocks_on(&setup, text))
            .iter()
            .map(|t| t[0] / 1_000_000)
            .collect();
        assert_eq!(x, [2, 3, 4, 5, 3, 1, 3, 1]);
    }

    #[test]
    fn both_spellings_of_a_polynomial_read_alike() {
        let brackets = blocks("G1 F1 X0\nPOLY PO[X]=(10,2,-1) PO[Y]=(5,0.5) PO[]=(2,1) Z1 PL=4");
        let wire = blocks("G1 F1 X0\nPOLY\nPOX Q2 Q-1 POY Q0.5\nPOD Q2 Q1\nX10 Y5 Z1 PL4");
        let motion = |items: &[Item]| match &items[1] {
            Item::Block { motion, target, .. } => (motion.clone(), *target),
            Item::Standstill => panic!("a block"),
        };
        assert_eq!(motion(&brackets), motion(&wire));
    }
}
