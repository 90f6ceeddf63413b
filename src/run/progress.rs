//! A line per restart on standard error: redrawn in place on a terminal, said now and then elsewhere.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

use rustix::termios::tcgetwinsize;
use salp_core::study::Study;
use salp_protocol::{Event, StudyId};
use salp_worker::Client;
use serde_json::Value;

use crate::failure::Failure;
use crate::output::number;

/// Between two redraws of a terminal.
const REDRAW: Duration = Duration::from_millis(250);
/// Between two lines of a restart where nobody redraws.
const SAY_AGAIN: Duration = Duration::from_secs(20);

/// What is known of each restart.
pub struct Progress<'a> {
    study: &'a Study,
    /// By step and index.
    lines: Vec<Line>,
    after: i64,
    began: Instant,
    terminal: bool,
    drawn_at: Option<Instant>,
    drawn_lines: usize,
}

struct Line {
    step: usize,
    index: usize,
    label: String,
    evaluations: u64,
    best: Option<f64>,
    done: Option<String>,
    said: Option<(Instant, u64)>,
    /// When it had ended, for its elapsed time.
    ended: Option<Instant>,
}

impl<'a> Progress<'a> {
    /// Of a study whose events were not seen yet.
    pub fn new(study: &'a Study) -> Self {
        Self {
            study,
            lines: Vec::new(),
            after: 0,
            began: Instant::now(),
            terminal: std::io::stderr().is_terminal(),
            drawn_at: None,
            drawn_lines: 0,
        }
    }

    /// Takes up the events since the last call; waits for one up to `wait_s`.
    pub fn follow(&mut self, client: &Client, id: &StudyId, wait_s: f64) -> Result<(), Failure> {
        let mut wait_s = wait_s;
        loop {
            let events = client.events(id, self.after, wait_s)?;
            wait_s = 0.0;
            for event in &events {
                self.after = event.id;
                self.take(event);
            }
            if events.is_empty() {
                break;
            }
        }
        self.draw(false);
        Ok(())
    }

    fn take(&mut self, event: &Event) {
        let field = |name: &str| event.data.get(name);
        let whole = |name: &str| field(name).and_then(serde_json::Value::as_u64);
        let (Some(step), Some(index)) = (whole("step"), whole("restart")) else {
            return;
        };
        // A band is none of the optimiser's evaluations.
        if field("band_of").is_some() {
            return;
        }
        let line = self.line(step as usize, index as usize, field("summary"));
        let says = |name: &str| field(name).and_then(serde_json::Value::as_bool);
        match event.kind.as_str() {
            "evaluation" => {
                line.evaluations += 1;
                let objective = field("objective").and_then(serde_json::Value::as_f64);
                let counts = says("counts")
                    .unwrap_or(says("feasible") == Some(true) && says("overlap") != Some(true));
                if let (Some(objective), true) = (objective, counts) {
                    line.best = Some(line.best.map_or(objective, |best| best.min(objective)));
                }
            }
            "restart" if field("state").and_then(|s| s.as_str()) == Some("done") => {
                let reason = event.data.get("summary").and_then(crate::show::stop_reason);
                line.done = Some(reason.unwrap_or("done").to_owned());
                line.ended = Some(Instant::now());
            }
            _ => {}
        }
    }

    /// The line of a restart, begun where it is new.
    fn line(&mut self, step: usize, index: usize, summary: Option<&Value>) -> &mut Line {
        let place = self
            .lines
            .partition_point(|l| (l.step, l.index) < (step, index));
        let known = self.lines.get(place);
        if known.is_none_or(|l| (l.step, l.index) != (step, index)) {
            let id = self.study.steps.get(step).map_or("", |s| s.id.as_str());
            let label = label(self.study, step, index, summary.unwrap_or(&Value::Null));
            let line = Line {
                step,
                index,
                label: format!("{id} {label}"),
                evaluations: 0,
                best: None,
                done: None,
                said: None,
                ended: None,
            };
            self.lines.insert(place, line);
        }
        &mut self.lines[place]
    }

    fn draw(&mut self, last: bool) {
        let now = Instant::now();
        if self.terminal {
            if !last && self.drawn_at.is_some_and(|at| now - at < REDRAW) {
                return;
            }
            self.drawn_at = Some(now);
            let texts = self.screen();
            let mut out = String::new();
            if self.drawn_lines > 0 {
                out += &format!("\x1b[{}A", self.drawn_lines);
            }
            for text in &texts {
                out += &format!("\x1b[2K{text}\n");
            }
            // What the last picture had below.
            out += "\x1b[J";
            self.drawn_lines = texts.len();
            let _ = write!(std::io::stderr().lock(), "{out}");
            return;
        }
        for i in 0..self.lines.len() {
            let line = &self.lines[i];
            let due = match line.said {
                None => line.evaluations > 0 || line.done.is_some(),
                Some((at, evaluations)) => {
                    let news = evaluations != line.evaluations;
                    let ended = line.done.is_some() && evaluations != u64::MAX;
                    ended || (news && line.done.is_none() && (last || now - at >= SAY_AGAIN))
                }
            };
            if due {
                let text = self.text(line);
                crate::output::note(&text);
                let evaluations = if line.done.is_some() {
                    u64::MAX
                } else {
                    line.evaluations
                };
                self.lines[i].said = Some((now, evaluations));
            }
        }
    }

    /// What fits on the terminal: a line that wraps, or scrolls away, could not be redrawn. Restarts that go on first.
    fn screen(&self) -> Vec<String> {
        let size = tcgetwinsize(std::io::stderr()).ok();
        let (columns, rows) = size.map_or((80, 24), |s| (s.ws_col as usize, s.ws_row as usize));
        let room = rows.max(4) - 2;
        let mut shown: Vec<&Line> = self.lines.iter().filter(|l| l.done.is_none()).collect();
        shown.extend(self.lines.iter().rev().filter(|l| l.done.is_some()));
        shown.truncate(room);
        shown.sort_by_key(|l| (l.step, l.index));
        let hidden = self.lines.len() - shown.len();
        let mut texts: Vec<String> = shown.into_iter().map(|l| self.text(l)).collect();
        if hidden > 0 {
            texts.push(format!("and {hidden} more restarts"));
        }
        for text in &mut texts {
            *text = text.chars().take(columns.max(20) - 1).collect();
        }
        texts
    }

    fn text(&self, line: &Line) -> String {
        let elapsed = line.ended.unwrap_or_else(Instant::now) - self.began;
        format!(
            "{}: {} evaluations, best {}, {:.1} s{}",
            line.label,
            line.evaluations,
            number(line.best),
            elapsed.as_secs_f64(),
            line.done
                .as_ref()
                .map_or_else(String::new, |why| format!(", ended: {why}"))
        )
    }

    /// Says where everything stands.
    pub fn finish(&mut self) {
        self.draw(true);
    }
}

/// A name for a restart: its number, start and sense, as its summary has them; the points of a sweep may count in either.
pub fn label(study: &Study, step: usize, index: usize, summary: &Value) -> String {
    let target = study.steps.get(step).and_then(|s| s.target.as_ref());
    let sense = match summary["orientation"].as_str() {
        Some("counter_clockwise") => Some("counter-clockwise"),
        Some(sense) => Some(sense),
        None => target
            .filter(|target| target.either_sense)
            .map(|_| "the larger sense at each point"),
    };
    let words: Vec<&str> = [summary["start"].as_str(), sense]
        .into_iter()
        .flatten()
        .collect();
    if words.is_empty() {
        format!("restart {index}")
    } else {
        format!("restart {index} ({})", words.join(", "))
    }
}
