//! `salp reproduce question`: does the hierarchy still pay when gradients are nearly free? The protocol is in
//! `docs/open-question.md`. Interrupted, the same command goes on where it was.

mod arms;
mod score;
mod tell;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use salp_core::analysis::{Sample, Trace};
use salp_core::fault::Faults;
use salp_protocol::StudyState;
use serde_json::Value;

use crate::failure::Failure;
use crate::output::{note, write_file};
use crate::parallel::in_parallel;
use crate::raster::write_picture;
use crate::run::Setting;
use crate::run::reproduce::realised::{TIPS, WHOLE, on};
use arms::{ARMS, Arm, PARENT};
use score::{Scored, score};

/// Starts of every arm: of the protocol, and of a quick look.
const STARTS: usize = 20;
const QUICK_STARTS: usize = 2;

/// How well every arm looks.
#[derive(Clone, Copy, Default)]
pub struct Fidelity {
    /// Coarse, and says so.
    pub quick: bool,
    /// Most iterations of a run, where they are not those of the protocol or of a quick look.
    pub iterations: Option<u16>,
}

/// The arms of the question in a folder.
pub struct Question<'a> {
    /// How well every arm looks.
    pub fidelity: Fidelity,
    /// Starts of every arm.
    pub starts: Option<usize>,
    /// Only these arms; empty: all.
    pub only: &'a [String],
    /// How studies are run.
    pub setting: &'a Setting,
    /// Folder of the results.
    pub out: &'a Path,
}

/// An arm that has ended.
struct Played {
    arm: Arm,
    /// Starts.
    starts: usize,
    /// What the runs took from another arm cost, CPU seconds each; empty of an arm of its own.
    before: Vec<f64>,
    scored: Vec<Scored>,
}

impl Played {
    /// Runs by the score of one of the tips: an area of a whole run is known at its end.
    fn sample(&self, tip: usize) -> Sample {
        let run = |(k, scored): (usize, &Scored)| {
            let before = self.before.get(k).copied().unwrap_or(0.0);
            let area = scored.areas_mm2.map(|areas| -areas[tip]);
            Trace::new([(before + scored.cpu_s(), area)])
        };
        Sample {
            before: 0.0,
            runs: self.scored.iter().enumerate().map(run).collect(),
        }
    }

    /// The best of its designs by one of the tips.
    fn best(&self, tip: usize) -> Option<&Scored> {
        let area = |scored: &Scored| scored.areas_mm2.map_or(0.0, |areas| areas[tip]);
        let counting = self.scored.iter().filter(|s| s.areas_mm2.is_some());
        counting.max_by(|a, b| area(a).total_cmp(&area(b)))
    }
}

impl Question<'_> {
    /// Runs what has not ended yet; document and text of what came out.
    pub fn run(&self, interrupted: &AtomicBool) -> Result<(Value, String), Failure> {
        let mut faults = Faults::default();
        for (i, id) in self.only.iter().enumerate() {
            if !ARMS.iter().any(|arm| arm.id == id) {
                let known: Vec<&str> = ARMS.iter().map(|arm| arm.id).collect();
                let message = format!("no arm is named \"{id}\"; there are {}", known.join(", "));
                faults.add(format!("--arms[{i}]"), message);
            }
        }
        faults.check(())?;
        let count = self.starts.unwrap_or(if self.fidelity.quick {
            QUICK_STARTS
        } else {
            STARTS
        });
        let starts = arms::starts(count)?;
        let asked = |arm: &Arm| self.only.is_empty() || self.only.iter().any(|id| id == arm.id);
        let needs_parent = ARMS.iter().any(|arm| arm.is_freed() && asked(arm));
        let mut played: Vec<Played> = Vec::new();
        for arm in ARMS {
            if !(asked(&arm) || needs_parent && arm.id == PARENT) {
                continue;
            }
            note(&format!("arm {}: {}", arm.id, arm.title));
            let (given, before) = if arm.is_freed() {
                winners(&played)
            } else {
                (starts.clone(), Vec::new())
            };
            if given.is_empty() {
                note(&format!("{}: nothing to start from", arm.id));
                continue;
            }
            played.push(self.play(arm, &given, before, interrupted)?);
            // What there is is told after every arm: the whole takes long.
            self.tell(&played)?;
        }
        self.tell(&played)
    }

    fn play(
        &self,
        arm: Arm,
        starts: &[Vec<f64>],
        before: Vec<f64>,
        interrupted: &AtomicBool,
    ) -> Result<Played, Failure> {
        let study = arm.study(starts, self.fidelity)?;
        let folder = self.out.join(arm.id);
        let ended = self
            .setting
            .carry_out(&study, folder.clone(), interrupted)?;
        if ended.state == StudyState::Paused {
            return Err(Failure::Paused);
        }
        let results = ended.results;
        let restarts = &results.restarts;
        let of = |k: usize| {
            let file = folder
                .join("realised")
                .join(format!("restart-{}.json", restarts[k].index));
            score(
                &study,
                &restarts[k],
                &results.ledger,
                self.fidelity.quick,
                &file,
            )
        };
        let told = |done: usize, _: &Result<Scored, Failure>| {
            note(&format!(
                "{}: {done} of {} on nine units",
                arm.id,
                restarts.len()
            ));
        };
        let threads = self.setting.workers.min(restarts.len()).max(1);
        let scored = in_parallel(threads, restarts.len(), of, told);
        let played = Played {
            starts: starts.len(),
            before,
            scored: scored.into_iter().collect::<Result<_, _>>()?,
            arm,
        };
        let winner = played.best(0).map(|scored| scored.restart);
        let winner = restarts.iter().find(|r| Some(r.index) == winner);
        let scene = winner
            .and_then(score::best)
            .and_then(|best| score::scene(&study, &best))
            .and_then(|scene| on(&scene, WHOLE, self.fidelity.quick));
        if let Some(scene) = scene {
            let pretty = serde_json::to_string_pretty(&scene.document()).unwrap_or_default();
            let file = self.out.join(format!("best-{}.json", arm.id));
            write_file(&file, &pretty)?;
        }
        Ok(played)
    }

    fn tell(&self, played: &[Played]) -> Result<(Value, String), Failure> {
        for (tip, unit) in TIPS.iter().enumerate() {
            let figure = tell::figure(played, tip, self.fidelity);
            write_picture(&self.out.join(format!("unit-{unit}.svg")), &figure.0)?;
            write_file(&self.out.join(format!("unit-{unit}.csv")), &figure.1)?;
        }
        let (document, text) = tell::summary(played, self.fidelity, self.out);
        let pretty = serde_json::to_string_pretty(&document).unwrap_or_default();
        write_file(&self.out.join("summary.json"), &pretty)?;
        write_file(&self.out.join("summary.txt"), &format!("{text}\n"))?;
        write_file(&self.out.join("restarts.csv"), &tell::restarts(played))?;
        Ok((document, text))
    }
}

/// Of each start of the arm that another one begins with: the better of the designs that its two senses led to, and what
/// both of them cost, once for each sense in which it goes on.
fn winners(played: &[Played]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let parent = played.iter().find(|p| p.arm.id == PARENT);
    let runs = parent.map_or(&[][..], |parent| &parent.scored);
    let (mut designs, mut costs) = (Vec::new(), Vec::new());
    for senses in runs.chunks(2) {
        let objective = |scored: &&Scored| scored.objective.unwrap_or(f64::INFINITY);
        let better = senses
            .iter()
            .min_by(|a, b| objective(a).total_cmp(&objective(b)));
        if let Some(x) = better.and_then(|scored| scored.x.clone()) {
            designs.push(x);
            let cost: f64 = senses.iter().map(|scored| scored.search_cpu_s).sum();
            costs.extend([cost; 2]);
        }
    }
    (designs, costs)
}
