//! The loop: claim, hold, evaluate, report.

use std::collections::VecDeque;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use salp_core::study::{Outcome, OutcomeStatus};
use salp_protocol::problem::{COMMANDS_NOT_ALLOWED, DRAINED, STALE_LEASE, WORKER_MISMATCH};
use salp_protocol::{Claim, ClaimRequest, ReportRequest, StudyId, WorkerIdentity};
use tracing::{debug, info, info_span, warn};

use crate::client::{Client, ClientError};
use crate::config::WorkerConfig;
use crate::evaluate::Models;
use crate::heartbeat::{Heart, Lease};
use crate::identity::identity;
use crate::stop::{Stop, die_with_parent};

/// Studies whose models are kept at hand.
const KEPT_STUDIES: usize = 4;
/// Longest pause between two tries to reach the coordinator.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// How often a waiting worker looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Why a worker did not start.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The address is none.
    #[error("\"{0}\" is not an address like http://127.0.0.1:8080")]
    Address(String),
    /// No random numbers for an id.
    #[error("no random numbers: {0}")]
    NoRandomness(String),
    /// No thread, or no signal handler.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// The coordinator refuses the token.
    #[error("the coordinator refuses this worker: {0}")]
    Refused(String),
}

/// How a worker ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerEnd {
    /// It was told to end.
    Stopped {
        /// Results that the coordinator took.
        evaluations: u64,
    },
}

/// Works until told to end: by a signal, by the coordinator, or by `stop`.
///
/// # Errors
/// [`WorkerError`] where it cannot start, or where the coordinator refuses its token. A coordinator that cannot be
/// reached is no error: the worker says so and waits.
pub fn run(config: &WorkerConfig, stop: &Stop) -> Result<WorkerEnd, WorkerError> {
    if !config.url.starts_with("http://") || config.url.len() == "http://".len() {
        return Err(WorkerError::Address(config.url.clone()));
    }
    if config.die_with_parent {
        die_with_parent()?;
    }
    if config.take_signals {
        stop.take_signals()?;
    }
    let me = identity().map_err(|failure| WorkerError::NoRandomness(failure.to_string()))?;
    let _span = info_span!("worker", worker = %me.id).entered();
    info!(
        build = me.build,
        instruction_set = me.instruction_set,
        url = config.url,
        "ready"
    );
    let token = config.token.as_deref();
    let heartbeats = Client::new(&config.url, token, Duration::from_secs(4));
    let mut worker = Worker {
        client: Client::new(&config.url, token, config.wait + Duration::from_secs(15)),
        heart: Heart::start(heartbeats)?,
        me,
        config,
        stop,
        kept: VecDeque::new(),
        evaluations: 0,
        waiting: None,
        failures: 0,
    };
    worker.work()?;
    info!(evaluations = worker.evaluations, "ended");
    Ok(WorkerEnd::Stopped {
        evaluations: worker.evaluations,
    })
}

struct Worker<'a> {
    config: &'a WorkerConfig,
    stop: &'a Stop,
    client: Client,
    heart: Heart,
    me: WorkerIdentity,
    kept: VecDeque<(StudyId, Models)>,
    evaluations: u64,
    /// Why it waits, said once per reason.
    waiting: Option<String>,
    /// Failed tries in a row.
    failures: u32,
}

impl Worker<'_> {
    fn work(&mut self) -> Result<(), WorkerError> {
        while !self.stop.after_this() {
            match self.claim() {
                None => return Ok(()),
                Some(Ok(None)) => self.reached(),
                Some(Ok(Some(claim))) => {
                    self.reached();
                    if self.take(claim) {
                        self.stop.ask();
                    }
                }
                Some(Err(failure)) => self.back_off(&failure)?,
            }
        }
        Ok(())
    }

    /// Claims; `None` when told to end while it waits. The connection is dropped then, and with it the claim.
    fn claim(&self) -> Option<Result<Option<Claim>, ClientError>> {
        let request = ClaimRequest {
            worker: self.me.clone(),
            allow_commands: self.config.commands.is_some(),
            wait_s: self.config.wait.as_secs_f64(),
            known_studies: self.kept.iter().map(|(id, _)| id.clone()).collect(),
        };
        let client = self.client.clone();
        let (send, answer) = channel();
        thread::spawn(move || {
            // Nobody listens any more when the worker has ended.
            let _ = send.send(client.claim(&request));
        });
        loop {
            match answer.recv_timeout(LOOK) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Timeout) if self.stop.after_this() => return None,
                Err(RecvTimeoutError::Timeout) => {}
                // Only if the thread panicked: as good as no work.
                Err(RecvTimeoutError::Disconnected) => return Some(Ok(None)),
            }
        }
    }

    fn reached(&mut self) {
        self.failures = 0;
        if let Some(why) = self.waiting.take() {
            info!("goes on; it waited because: {why}");
        }
    }

    /// Says why it waits, once per reason, and waits.
    fn back_off(&mut self, failure: &ClientError) -> Result<(), WorkerError> {
        match failure {
            ClientError::Refused(problem) if problem.kind == DRAINED => {
                info!("told to end");
                self.stop.ask();
                return Ok(());
            }
            ClientError::Refused(problem)
                if problem.status < 500
                    && problem.kind != WORKER_MISMATCH
                    && problem.kind != COMMANDS_NOT_ALLOWED =>
            {
                return Err(WorkerError::Refused(problem.to_string()));
            }
            _ => {}
        }
        let why = failure.to_string();
        if self.waiting.as_ref() != Some(&why) {
            warn!("waiting: {why}");
            self.waiting = Some(why);
        }
        self.failures += 1;
        self.pause(pause(self.failures));
        Ok(())
    }

    fn pause(&self, length: Duration) {
        let until = Instant::now() + length;
        while Instant::now() < until && !self.stop.after_this() {
            thread::sleep(LOOK.min(until.saturating_duration_since(Instant::now())));
        }
    }

    /// Evaluates and reports; true if the coordinator wants the worker to end.
    fn take(&mut self, claim: Claim) -> bool {
        let Claim {
            evaluation,
            fence,
            attempt,
            lease_s,
            study,
            restart,
            document,
            request,
        } = claim;
        let span = info_span!("evaluation", %study, step = request.step, restart, %evaluation, fence, attempt);
        let _entered = span.enter();
        let length = Duration::try_from_secs_f64(lease_s).unwrap_or(Duration::from_secs(15));
        let held = self.heart.hold(evaluation.clone(), fence, length);
        let lease = &held.lease;
        let stop = self.stop;
        let cancel = || lease.is_over() || stop.at_once();
        if let Some(document) = &document {
            self.kept.retain(|(id, _)| *id != study);
            self.kept.truncate(KEPT_STUDIES - 1);
            let models = Models::read(document, self.config.commands.as_deref());
            self.kept.push_front((study.clone(), models));
        }
        let models = self.kept.iter_mut().find(|(id, _)| *id == study);
        let outcome = match models {
            Some((_, models)) => models.evaluate(&request, &cancel),
            // The coordinator thinks that the document is here; giving it back is all there is to do.
            None => Outcome::without_values(OutcomeStatus::Cancelled),
        };
        if lease.is_lost() {
            info!("dropped: the lease is lost");
        } else if outcome.status == OutcomeStatus::Cancelled && stop.at_once() {
            if let Err(failure) = self.client.release(&evaluation, fence) {
                info!("could not give the evaluation back: {failure}");
            }
        } else {
            debug!(?outcome.status, outcome.objective, outcome.wall_s, "evaluated");
            let report = ReportRequest {
                fence,
                worker: self.me.clone(),
                outcome,
            };
            if self.report(&evaluation, report, lease) {
                self.evaluations += 1;
            }
        }
        lease.wants_drain()
    }

    /// Reports until the coordinator answers; true if it took the outcome.
    fn report(
        &self,
        evaluation: &salp_protocol::EvaluationId,
        mut report: ReportRequest<Outcome>,
        lease: &Lease,
    ) -> bool {
        let (mut failures, mut refused) = (0, false);
        loop {
            match self.client.report(evaluation, &report) {
                Ok(_) => return true,
                Err(refused) if refused.problem() == Some(STALE_LEASE) => {
                    info!("dropped: another worker has this evaluation now");
                    return false;
                }
                Err(failure) if !failure.is_passing() => {
                    warn!("the coordinator refuses the result: {failure}");
                    if refused {
                        return false;
                    }
                    // Without any result it would be evaluated again and refused again.
                    refused = true;
                    report.outcome = Outcome::without_values(OutcomeStatus::NotConverged {
                        reason: format!("the coordinator refused the result: {failure}"),
                        load_fraction: 0.0,
                    });
                }
                Err(failure) => {
                    if failures == 0 {
                        warn!("waiting with a result: {failure}");
                    }
                    failures += 1;
                    // A report under an expired lease is still taken as long as nobody else has claimed the evaluation.
                    let until = Instant::now() + pause(failures);
                    while Instant::now() < until {
                        thread::sleep(LOOK);
                        if self.stop.at_once() || (lease.is_lost() && self.stop.after_this()) {
                            return false;
                        }
                    }
                }
            }
        }
    }
}

/// From 0.2 s doubling up to 5 s, of which a random part between a half and all is waited: many workers do not come
/// back at once.
fn pause(failures: u32) -> Duration {
    let longest = Duration::from_millis(100)
        .saturating_mul(1 << failures.min(10))
        .min(LONGEST_PAUSE);
    // Without random numbers it waits the whole.
    let random = getrandom::u32().unwrap_or(u32::MAX);
    longest.mul_f64(0.5 + 0.5 * f64::from(random) / f64::from(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_to_five_seconds_and_differ() {
        assert!(pause(1) <= Duration::from_millis(200));
        assert!(pause(1) >= Duration::from_millis(100));
        let long: Vec<_> = (0..20).map(|_| pause(40)).collect();
        assert!(long.iter().all(|p| (2.5..=5.0).contains(&p.as_secs_f64())));
        assert!(long.iter().any(|p| *p != long[0]));
    }
}
