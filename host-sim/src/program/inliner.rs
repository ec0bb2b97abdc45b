//! Follows a program line by line: calls, repetitions, returns, jumps and R parameters; what is left is streamed.
//!
//! In: the main program and the folder its sub-programs lie in. Out: a [`Program`]. Expressions are evaluated by the
//! core's own evaluator, so that host and machine never disagree about a jump. The core gets the assignments too and
//! works them out again.

use std::collections::HashMap;
use std::path::PathBuf;

use pentaspline::config::Dialect;
use pentaspline::nc::expression::{compare, evaluate, parameter_index, Fault};
use pentaspline::nc::parameters::Parameters;
use pentaspline::nc::LINE_MAX;

use super::flow::{self, Action, Direction, Frame, Name, Statement, Target};
use super::wire;
use super::words::{self, skip_blanks, Line};
use super::{Origin, Program, Reading, Source, NESTING_MAX};
use crate::diagnostics::{Exit, Failure, Located};

/// What a sub-program file may be called behind its name.
const EXTENSIONS: [&str; 5] = ["SPF", "MPF", "spf", "mpf", "nc"];
/// The same for Heidenhain programs.
const EXTENSIONS_CONVERSATIONAL: [&str; 4] = ["H", "h", "I", "i"];

/// Jump targets of one file: lines from 0, in order.
type Targets = HashMap<Target, Vec<u32>>;

/// Work in progress of [`inline`].
struct Inliner<'a> {
    program: Program,
    reading: &'a Reading,
    folder: Option<PathBuf>,
    /// Sub-programs found so far, by upper-case name.
    known: HashMap<String, Option<u32>>,
    /// Upper-case names of the programs being inlined, outermost first.
    active: Vec<String>,
    parameters: Parameters,
    /// Assignments to R parameters so far. A jump that comes round again without a new one never ends.
    assignments: u64,
    /// Lines run through so far.
    steps: usize,
    /// Per source, once a jump has asked for them.
    targets: HashMap<u32, Targets>,
    /// Last jump taken, for a program that is too long.
    last_jump: Option<(Origin, Name)>,
}

/// Where a file goes on behind a line.
enum Next {
    Line,
    Jump(u32),
    End,
}

/// Follows `main`, called `stem` (upper case), to its end.
///
/// # Errors
/// See [`Program::load_as`].
pub fn inline(
    main: Source,
    stem: String,
    folder: Option<PathBuf>,
    reading: &Reading,
) -> Result<Program, Failure> {
    let program = Program {
        sources: vec![main],
        origins: Vec::new(),
        calls: Vec::new(),
        wire: Vec::new(),
        ends: Vec::new(),
        unused_from: None,
    };
    let mut inliner = Inliner {
        program,
        reading,
        folder,
        known: HashMap::new(),
        active: vec![stem],
        parameters: Parameters::new(),
        assignments: 0,
        steps: 0,
        targets: HashMap::new(),
        last_jump: None,
    };
    inliner.run(0, None)?;
    Ok(inliner.program)
}

impl Inliner<'_> {
    /// Follows one file from its first line to its end.
    fn run(&mut self, source: u32, call: Option<u32>) -> Result<(), Failure> {
        let count = self.program.sources[source as usize].lines.len();
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        // Assignments seen when the jump of a line was taken last.
        let mut taken: HashMap<u32, u64> = HashMap::new();
        let (mut line, mut farthest) = (0, 0);
        while line < count {
            let origin = Origin {
                source,
                line,
                call,
                rewritten: None,
            };
            farthest = farthest.max(line);
            match self.step(origin, &mut taken)? {
                Next::Line => line += 1,
                Next::Jump(target) => line = target,
                Next::End => {
                    if call.is_none() {
                        let source = &self.program.sources[source as usize];
                        let left = (farthest + 1..count)
                            .find(|&after| !source.line(after).trim().is_empty());
                        self.program.unused_from = left.map(|after| after as usize + 1);
                    }
                    break;
                }
            }
        }
        Ok(())
    }

    /// Does what one line says.
    fn step(&mut self, origin: Origin, taken: &mut HashMap<u32, u64>) -> Result<Next, Failure> {
        self.count(origin)?;
        let mut line = self.line(origin);
        if let Some(bad) = line.unsendable {
            let label = "means something to the wire; expected only in comments";
            return Err(self.refuse(origin, bad, 1, "character cannot be sent", label));
        }
        let statement = Statement::new(&line, self.reading.dialect);
        if statement.skippable && self.reading.block_skip {
            return Ok(Next::Line);
        }
        let called = origin.call.is_some();
        match statement.frame {
            Some(Frame::Begin) if called => return Ok(Next::Line),
            Some(Frame::End) if called => return Ok(Next::End),
            _ => {}
        }
        match statement.action {
            Action::Plain => {}
            Action::Declaration => return Ok(Next::Line),
            Action::Return => {
                return Ok(if called { Next::End } else { Next::Line });
            }
            Action::Refused {
                name,
                message,
                label,
            } => return Err(self.refuse_name(origin, &name, &message, label)),
            Action::Call { name, repeat } => {
                let Some(callee) = self.find(&name.text) else {
                    return Err(self.missing(origin, name));
                };
                self.enter(callee, origin, &name, repeat)?;
                return Ok(Next::Line);
            }
            Action::Jump(at) => {
                self.assign(origin, &line.code[..at])?;
                // What stands before the jump is for the core; a block number or a label alone is for nobody.
                let words = &line.code[statement.begin.min(at)..at];
                if !words.trim_ascii().is_empty() {
                    self.send(origin, line.wire[..at].trim_ascii_end().to_vec())?;
                }
                return self.jump(origin, &line, at, taken);
            }
        }
        if !line.header {
            self.assign(origin, &line.code)?;
        }
        let ends = line.ends_program || statement.frame == Some(Frame::End);
        let returns = called && (line.ends_program || line.returns);
        if called && line.header {
            // A header would start another program in the middle of this one.
            line.wire.clear();
        } else if called && line.ends_program {
            line.end_is_return(self.reading.dialect);
        }
        self.send(origin, line.wire)?;
        // M17, M2 and M30 return from a sub-program, M2 and M30 end the main program: what follows does not run.
        Ok(if returns || (ends && !called) {
            Next::End
        } else {
            Next::Line
        })
    }

    fn line(&self, origin: Origin) -> Line {
        Line::new(
            self.program.source(origin).line(origin.line),
            self.reading.dialect,
        )
    }

    /// Counts a line run through, or a line sent.
    fn count(&mut self, origin: Origin) -> Result<(), Failure> {
        if self.steps < self.reading.lines_max && self.program.ends.len() < self.reading.lines_max {
            self.steps += 1;
            return Ok(());
        }
        let label = "more lines than the host follows";
        Err(match self.last_jump.take() {
            Some((at, name)) => {
                let message = format!("program too long: this jump to {} has no end", name.text);
                self.refuse_name(at, &name, &message, label)
            }
            None => self.refuse(origin, 0, 1, "program too long", label),
        })
    }

    /// Appends a line to the stream, in the spelling of the wire where it is too long for it.
    fn send(&mut self, origin: Origin, line: Vec<u8>) -> Result<(), Failure> {
        if line.len() > LINE_MAX && self.reading.dialect == Dialect::Sinumerik {
            if let Some(pieces) = wire::split(&line) {
                for piece in pieces {
                    self.push(
                        Origin {
                            rewritten: u32::try_from(piece.column).ok(),
                            ..origin
                        },
                        &piece.text,
                    );
                }
                return Ok(());
            }
        }
        self.push(origin, &line);
        Ok(())
    }

    fn push(&mut self, origin: Origin, line: &[u8]) {
        self.program.origins.push(origin);
        self.program.wire.extend_from_slice(line);
        self.program.ends.push(self.program.wire.len());
    }

    /// Carries out the assignments `R1=..` in `code`, from left to right.
    fn assign(&mut self, origin: Origin, code: &[u8]) -> Result<(), Failure> {
        if self.reading.dialect != Dialect::Sinumerik || !code.contains(&b'=') {
            return Ok(());
        }
        let mut at = 0;
        while at < code.len() {
            let glued = at > 0 && (code[at - 1].is_ascii_alphabetic() || code[at - 1] == b'_');
            let mut end = at;
            let index = match code[at] {
                b'R' if !glued => parameter_index(code, &mut end, &self.parameters),
                _ => {
                    at += 1;
                    continue;
                }
            };
            end = skip_blanks(code, end);
            let assigned = code.get(end) == Some(&b'=') && code.get(end + 1) != Some(&b'=');
            match index {
                Ok(index) if assigned => {
                    end += 1;
                    let value = evaluate(code, &mut end, &self.parameters)
                        .map_err(|fault| self.refuse_expression(origin, &fault))?;
                    self.parameters.set(index, value);
                    self.assignments += 1;
                    at = end;
                }
                // On the right side of another address, or wrong: the core says what.
                _ => at += 1,
            }
        }
        Ok(())
    }

    /// Follows `IF` and `GOTO..` from column `at` on.
    fn jump(
        &mut self,
        origin: Origin,
        line: &Line,
        mut at: usize,
        taken: &mut HashMap<u32, u64>,
    ) -> Result<Next, Failure> {
        let code = line.code.as_slice();
        loop {
            at = skip_blanks(code, at);
            if at >= code.len() {
                return Ok(Next::Line);
            }
            let mut holds = true;
            if code[at..].starts_with(b"IF") && flow::identifier(code, at) == 2 {
                at += 2;
                holds = compare(code, &mut at, &self.parameters)
                    .map_err(|fault| self.refuse_expression(origin, &fault))?;
                at = skip_blanks(code, at);
            }
            let Some((direction, end)) = flow::jump_word(code, at) else {
                let width = words::word_len(self.program.source(origin).line(origin.line), at);
                let label = "expected GOTOF or GOTOB here";
                return Err(self.refuse(origin, at, width, "not a jump", label));
            };
            let Some((target, name)) = flow::target(line, skip_blanks(code, end)) else {
                let label = "expected a label or a block number behind this";
                return Err(self.refuse(origin, at, end - at, "jump without a target", label));
            };
            at = name.column + name.text.len();
            let to = self.look_up(origin, direction, &target, &name)?;
            if !holds {
                continue;
            }
            if taken.insert(origin.line, self.assignments) == Some(self.assignments) {
                let message = format!("endless loop: the jump to {} is always taken", name.text);
                let label = "no R parameter changes before it comes round again";
                return Err(self.refuse_name(origin, &name, &message, label));
            }
            self.last_jump = Some((origin, name));
            return Ok(Next::Jump(to));
        }
    }

    /// Line of the target of a jump.
    fn look_up(
        &mut self,
        origin: Origin,
        direction: Direction,
        target: &Target,
        name: &Name,
    ) -> Result<u32, Failure> {
        self.index_targets(origin.source);
        let lines = self.targets[&origin.source]
            .get(target)
            .map_or(&[][..], Vec::as_slice);
        if let (Target::Label(_), [first, second, ..]) = (target, lines) {
            let at = Origin {
                line: *second,
                ..origin
            };
            let message = format!("label {} stands in the file twice", name.text);
            let first = first + 1;
            let line = self.line(at);
            let column = Statement::new(&line, self.reading.dialect)
                .label
                .map_or(0, |label| label.column);
            let label = format!(
                "first in line {first}, jumped to from line {}",
                origin.line + 1
            );
            return Err(self.refuse(at, column, name.text.len(), &message, &label));
        }
        let ahead = lines.iter().find(|&&line| line > origin.line);
        let behind = lines.iter().rev().find(|&&line| line <= origin.line);
        let found = match direction {
            Direction::Forward => ahead,
            Direction::Backward => behind,
            Direction::Either => ahead.or(behind),
        };
        if let Some(line) = found {
            return Ok(*line);
        }
        let what = match target {
            Target::Label(_) => "label",
            Target::Number(_) => "block",
        };
        let message = format!("no {what} {} to jump to", name.text);
        let label = if let Some(line) = ahead.or(behind) {
            let other = if direction == Direction::Forward {
                "GOTOB"
            } else {
                "GOTOF"
            };
            format!("it stands in line {}; expected {other}", line + 1)
        } else if let Some(other) = self.elsewhere(origin.source, target) {
            format!("it stands in {other}; a jump stays in its file")
        } else {
            match target {
                Target::Label(_) => {
                    "expected a line of this file that begins with the name and `:`".to_owned()
                }
                Target::Number(_) => {
                    "expected a line of this file with this block number".to_owned()
                }
            }
        };
        Err(self.refuse_name(origin, name, &message, &label))
    }

    /// Name of another file read so far that has `target`.
    fn elsewhere(&mut self, source: u32, target: &Target) -> Option<String> {
        let count = u32::try_from(self.program.sources.len()).unwrap_or(u32::MAX);
        let found = (0..count).filter(|&other| other != source).find(|&other| {
            self.index_targets(other);
            self.targets[&other].contains_key(target)
        })?;
        Some(self.program.sources[found as usize].name.clone())
    }

    fn index_targets(&mut self, source: u32) {
        if self.targets.contains_key(&source) {
            return;
        }
        let mut targets = Targets::new();
        let file = &self.program.sources[source as usize];
        for line in 0..u32::try_from(file.lines.len()).unwrap_or(u32::MAX) {
            let parsed = Line::new(file.line(line), self.reading.dialect);
            let statement = Statement::new(&parsed, self.reading.dialect);
            let label = statement
                .label
                .map(|label| Target::Label(label.text.to_uppercase()));
            let number = statement.number.map(Target::Number);
            for target in label.into_iter().chain(number) {
                targets.entry(target).or_default().push(line);
            }
        }
        self.targets.insert(source, targets);
    }

    fn enter(
        &mut self,
        callee: u32,
        origin: Origin,
        name: &Name,
        repeat: u32,
    ) -> Result<(), Failure> {
        let upper = name.text.to_uppercase();
        if self.active.contains(&upper) {
            let message = format!("sub-program {} calls itself", name.text);
            let label = "expected a program that is not running already";
            return Err(self.refuse_name(origin, name, &message, label));
        }
        if self.active.len() > NESTING_MAX {
            let message = format!("sub-programs nested deeper than {NESTING_MAX}");
            return Err(self.refuse_name(origin, name, &message, "this call is one too deep"));
        }
        let call = u32::try_from(self.program.calls.len()).ok();
        self.program.calls.push(origin);
        self.active.push(upper);
        for _ in 0..repeat {
            self.run(callee, call)?;
        }
        self.active.pop();
        Ok(())
    }

    /// Index of the source of sub-program `name`, read on first use.
    fn find(&mut self, name: &str) -> Option<u32> {
        let upper = name.to_uppercase();
        if let Some(found) = self.known.get(&upper) {
            return *found;
        }
        let found = self.read(name).and_then(|source| {
            self.program.sources.push(source);
            u32::try_from(self.program.sources.len() - 1).ok()
        });
        self.known.insert(upper, found);
        found
    }

    fn read(&self, name: &str) -> Option<Source> {
        let folder = self.folder.as_ref()?;
        let extensions = match self.reading.dialect {
            Dialect::Heidenhain => EXTENSIONS_CONVERSATIONAL.as_slice(),
            Dialect::Sinumerik | Dialect::Fanuc => EXTENSIONS.as_slice(),
        };
        for stem in [name.to_owned(), name.to_uppercase(), name.to_lowercase()] {
            for extension in extensions {
                let path = folder.join(format!("{stem}.{extension}"));
                if let Ok(bytes) = std::fs::read(&path) {
                    return Some(Source::new(path.display().to_string(), &bytes));
                }
            }
        }
        None
    }

    fn missing(&self, origin: Origin, name: Name) -> Failure {
        if flow::is_structured(&name.text) {
            let message = flow::structured_message(&name);
            return self.refuse_name(origin, &name, &message, flow::STRUCTURED_LABEL);
        }
        let message = format!("no sub-program {}", name.text);
        let label = match self.reading.dialect {
            Dialect::Heidenhain => "no file with this name and .H or .I beside the program",
            Dialect::Sinumerik | Dialect::Fanuc => {
                "neither an NC word nor a file with this name and .SPF, .MPF or .nc beside the program"
            }
        };
        self.refuse_name(origin, &name, &message, label)
    }

    fn refuse_expression(&self, origin: Origin, fault: &Fault) -> Failure {
        let message = fault.kind.message();
        let code = format!("error:{}", message.code);
        let excerpt: String = self
            .program
            .source(origin)
            .line(origin.line)
            .chars()
            .skip(fault.at)
            .take(fault.length)
            .collect();
        let text = message.text.replace("{}", &excerpt);
        self.refuse(origin, fault.at, fault.length.max(1), &text, &code)
    }

    fn refuse_name(&self, origin: Origin, name: &Name, message: &str, label: &str) -> Failure {
        let width = name.text.chars().count();
        self.refuse(origin, name.column, width, message, label)
    }

    fn refuse(
        &self,
        origin: Origin,
        column: usize,
        chars: usize,
        message: &str,
        label: &str,
    ) -> Failure {
        let source = self.program.source(origin);
        let (offset, len) = source.span(origin.line, column, chars);
        let located = Located::new(message).at(&source.name, &source.text, offset, len, label);
        let located = match self.program.calls_of(origin).as_slice() {
            [] => located,
            chain => located.help(format!("called from {}", chain.join(", from "))),
        };
        Failure::new(Exit::Program, located)
    }
}
