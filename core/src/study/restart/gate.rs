//! A restart that competes: where it waits for a decision, and how it goes on after one.

use serde::{Deserialize, Serialize};

use super::{RestartState, RestartStep, RestartStop};
use crate::optimiser::{self, Point};
use crate::study::error::StudyError;
use crate::study::race::{Competition, Decision, End, Fidelity, Gate, Mark, Merit, RaceRecord};
use crate::study::result::{EvaluationRequest, Outcome};
use crate::study::spec::{Study, StudyStep};
use crate::study::start::RestartSpec;

/// How a restart competes: what it shows to the others, and what it counts for itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Racing {
    record: RaceRecord,
    /// Evaluations since it came to its rung, or to the study's own fidelity.
    told: usize,
    /// Whether its next evaluation is that of a design which went up.
    rising: bool,
    /// The best so far at the study's own fidelity.
    best: Option<Merit>,
}

impl Racing {
    /// Of a restart that begins; `None` where those of its step do not compete.
    pub(super) fn open(step: &StudyStep, spec: &RestartSpec) -> Option<Box<Self>> {
        let competes = !step.restarts.competition.is_none() && !step.optimiser.is_sample();
        competes.then(|| {
            Box::new(Self {
                record: RaceRecord {
                    orientation: spec.orientation,
                    ..RaceRecord::default()
                },
                told: 0,
                rising: false,
                best: None,
            })
        })
    }
}

/// Takes the decision for which a restart waits. One that does not wait stays as it is.
pub fn pass(
    study: &Study,
    state: &RestartState,
    decision: &Decision,
) -> Result<RestartStep, StudyError> {
    let mut state = state.clone();
    let study = &*study.given(state.spec.step, &state.spec.given);
    let gate = state.waits_at();
    if let (Some(gate), Some(racing)) = (gate, &mut state.racing) {
        if let Some(mark) = racing.record.marks.last_mut() {
            mark.decision = Some(decision.clone());
        }
        match (decision.stop, gate) {
            (Some(stop), _) => {
                racing.record.out = true;
                state.stop = Some(RestartStop::Study(stop));
            }
            (None, Gate::Rung(rung)) => state.rise(study, rung + 1)?,
            (None, Gate::Check(_)) => state.go_on(study)?,
        }
        state.note_end();
    }
    Ok(state.into_step())
}

/// Brings back a restart that the competition stopped: it goes on at the study's own fidelity to its end, out of competition.
/// `None` where it was not stopped so.
pub fn resume(study: &Study, state: &RestartState) -> Result<Option<RestartStep>, StudyError> {
    let Some(RestartStop::Study(stop)) = state.stop else {
        return Ok(None);
    };
    let mut state = state.clone();
    let study = &*study.given(state.spec.step, &state.spec.given);
    let Some(racing) = state.racing.as_mut().filter(|_| stop.is_of_competition()) else {
        return Ok(None);
    };
    racing.record.resumed = true;
    state.stop = None;
    let top = competition(study, &state)?.rungs();
    if state.rung() < top {
        state.rise(study, top)?;
    } else {
        state.go_on(study)?;
    }
    Ok(Some(state.into_step()))
}

fn competition<'a>(study: &'a Study, state: &RestartState) -> Result<&'a Competition, StudyError> {
    Ok(&study.step(state.spec.step)?.restarts.competition)
}

/// The violation up to which designs are compared by their objective on a rung.
fn rung_tolerance(step: &StudyStep) -> f64 {
    let own = step.optimiser.violation_tolerance();
    let race = step.restarts.competition.race.as_ref();
    race.map_or(own, |race| race.tolerance.max(own))
}

impl RestartState {
    /// What it shows to the other restarts; `None` where they do not compete.
    pub fn race_record(&self) -> Option<&RaceRecord> {
        self.racing.as_ref().map(|racing| &racing.record)
    }

    /// The gate at which it waits for a decision, with nothing asked.
    pub fn waits_at(&self) -> Option<Gate> {
        self.race_record()
            .filter(|_| self.stop.is_none())?
            .waits_at()
    }

    /// The fidelity at which it is; `None`: the study's own.
    pub fn fidelity(&self, study: &Study) -> Result<Option<Fidelity>, StudyError> {
        Ok(competition(study, self)?
            .fidelity(self.rung())
            .filter(|_| self.racing.is_some()))
    }

    fn rung(&self) -> usize {
        self.race_record().map_or(0, |record| record.rung)
    }

    /// Books what an outcome is worth.
    pub(super) fn note_merit(
        &mut self,
        step: &StudyStep,
        request: &EvaluationRequest,
        outcome: &Outcome,
        violation: f64,
    ) {
        let Some(racing) = &mut self.racing else {
            return;
        };
        racing.told += 1;
        let within = |tolerance: f64| {
            outcome.objective.map_or(Merit::Failed, |objective| {
                Merit::of(objective, violation, tolerance)
            })
        };
        let merit = within(step.optimiser.violation_tolerance());
        let rising = std::mem::take(&mut racing.rising);
        let record = &mut racing.record;
        if rising
            && !record.out
            && let Some(mark) = record.marks.last_mut()
        {
            mark.next = Some(within(rung_tolerance(step)));
        }
        if request.fidelity.is_some() {
            return;
        }
        if !record.out {
            record.opened.get_or_insert(merit);
        }
        let counts = !outcome.walls_overlap() && !outcome.is_unstable();
        if counts && racing.best.is_none_or(|best| merit.better_than(&best)) {
            racing.best = Some(merit);
        }
    }

    /// Notes the end of a restart that ended by itself.
    pub(super) fn note_end(&mut self) {
        let x = self.shown().0;
        if let (Some(_), Some(racing)) = (self.stop, &mut self.racing)
            && !racing.record.out
        {
            let merit = racing.best.unwrap_or(Merit::Failed);
            racing.record.end = Some(End { x, merit });
            racing.record.out = true;
        }
    }

    /// Whether the optimiser's step led to a gate; the restart waits there then.
    pub(super) fn comes_to_gate(&mut self, study: &Study) -> Result<bool, StudyError> {
        let competition = competition(study, self)?;
        let Some(racing) = self.racing.as_ref().filter(|r| !r.record.out) else {
            return Ok(false);
        };
        let ended = self.optimiser.done().is_some();
        let at_boundary = self.optimiser.at_iteration_boundary();
        let record = &racing.record;
        let gate = if let Some(rung) = competition.rung(record.rung) {
            // Where the optimiser ends on a rung, its rung ends.
            let ends = ended || (at_boundary && racing.told >= rung.evaluations);
            ends.then_some(Gate::Rung(record.rung))
        } else {
            let checks = competition.checks_every();
            let check = checks.map(|every| Gate::Check(racing.told / every));
            let last = record.marks.last().map(|mark| mark.gate);
            check.filter(|gate| {
                at_boundary && *gate > Gate::Check(0) && last.is_none_or(|last| *gate > last)
            })
        };
        let Some(gate) = gate else { return Ok(false) };
        let (x, iterate) = self.shown();
        let tolerance = rung_tolerance(study.step(self.spec.step)?);
        let merit = match gate {
            Gate::Rung(_) => iterate.map(|p| Merit::of(p.objective, p.violation, tolerance)),
            Gate::Check(_) => racing.best,
        };
        let mark = Mark {
            gate,
            evaluations: self.evaluations,
            x,
            merit: merit.unwrap_or(Merit::Failed),
            next: None,
            decision: None,
        };
        if let Some(racing) = &mut self.racing {
            racing.record.marks.push(mark);
        }
        Ok(true)
    }

    /// The design with which it stands before the others: the iterate, or the start where there is none.
    fn shown(&self) -> (Vec<f64>, Option<Point>) {
        let iterate = self.optimiser.iterate().cloned();
        let x = iterate.as_ref().map_or(&self.spec.x0, |point| &point.x);
        (x.clone(), iterate)
    }

    /// Goes up to a rung with its design. Displacements stay behind: no evaluation starts from those of another.
    fn rise(&mut self, study: &Study, to: usize) -> Result<(), StudyError> {
        let competition = competition(study, self)?;
        let changes = competition.fidelity(self.rung()) != competition.fidelity(to);
        if let Some(racing) = &mut self.racing {
            racing.record.rung = to;
            racing.told = 0;
            racing.rising = changes;
        }
        if !changes {
            return self.go_on(study);
        }
        let x = self.shown().0;
        let mut next = if self.optimiser.done().is_some() {
            let step = study.step(self.spec.step)?;
            let problem = study.problem(self.spec.step)?;
            let options = step
                .optimiser
                .clone()
                .seeded(self.spec.seed, self.spec.index);
            let opened = optimiser::start(options, problem, x.clone());
            let (state, asks) = opened.map_err(|source| StudyError::Start {
                step: self.spec.step,
                source,
            })?;
            self.optimiser = state;
            asks
        } else {
            let rebased = optimiser::rebase(&self.optimiser);
            self.optimiser = rebased.state;
            rebased.asks
        };
        if let Some(drawn) = self.screened(study)? {
            next = drawn;
        }
        if let Some(base) = &mut self.plan_base {
            *base = x;
        }
        self.on_own_plan.clear();
        self.plan_failed = false;
        self.ask(study, next)
    }

    /// Goes on from a gate with what the optimiser was about to ask.
    fn go_on(&mut self, study: &Study) -> Result<(), StudyError> {
        self.stop = self.optimiser.done().map(RestartStop::Optimiser);
        if self.stop.is_some() {
            return Ok(());
        }
        let asks = match self.screened(study)? {
            Some(drawn) => drawn,
            None => self.replan(study)?.unwrap_or_else(|| self.optimiser.asks()),
        };
        self.ask(study, asks)
    }
}
