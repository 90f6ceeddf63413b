//! Claim with long poll, report, release.

use std::sync::Arc;
use std::time::Duration;

use salp_core::study::{Outcome, OutcomeStatus};
use salp_protocol::{Claim, ClaimRequest, EvaluationId, ReportRequest, WorkerIdentity};
use serde_json::Value;
use tokio::time::Instant;
use tracing::{Instrument as _, Span, field, info, instrument, warn};

use super::{Coordinator, CoordinatorError, LONGEST_WAIT_S};
use crate::store::{AcceptedReport, Claimed, Reported, RestartId, StoreError};

/// How often a held claim looks for leases that expired, which nobody announces.
const LOOK_AGAIN: Duration = Duration::from_secs(1);

impl Coordinator {
    /// Hands out work, and holds the answer back as long as there is none and the worker is willing to wait.
    #[instrument(skip_all, fields(worker = %request.worker.id))]
    pub async fn claim(
        self: &Arc<Self>,
        request: &ClaimRequest,
    ) -> Result<Claimed, CoordinatorError> {
        let wait = if request.wait_s.is_finite() {
            request.wait_s.clamp(0.0, LONGEST_WAIT_S)
        } else {
            0.0
        };
        let until = Instant::now() + Duration::from_secs_f64(wait);
        let lease_ms = self.config.lease.as_millis() as i64;
        let mut work = self.work.subscribe();
        let mut stopping = self.stopping();
        loop {
            work.borrow_and_update();
            let (this, asked) = (Arc::clone(self), request.clone());
            let claimed = to_its_end(async move { this.claim_now(&asked, lease_ms).await }).await?;
            match claimed {
                None => continue,
                Some(Claimed::Nothing) => {}
                Some(claimed) => return Ok(claimed),
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || *stopping.borrow() {
                return Ok(Claimed::Nothing);
            }
            tokio::select! {
                _ = work.changed() => {}
                _ = stopping.changed() => {}
                () = tokio::time::sleep(left.min(LOOK_AGAIN)) => {}
            }
        }
    }

    /// One look at the queue; `None` where it gave an evaluation that is completed already.
    async fn claim_now(
        self: &Arc<Self>,
        request: &ClaimRequest,
        lease_ms: i64,
    ) -> Result<Option<Claimed>, CoordinatorError> {
        let attempts = self.config.attempts;
        let answer = self.store.claim(request, lease_ms, attempts).await?;
        for restart in answer.lost {
            self.advance_in_background(restart);
        }
        if let Claimed::Work { claim, key } = &answer.claimed {
            info!(study = %claim.study, restart = claim.restart, evaluation = %claim.evaluation,
                fence = claim.fence, attempt = claim.attempt, "claimed");
            self.announce_news();
            if self.complete_known(&request.worker, claim, key).await? {
                return Ok(None);
            }
        }
        Ok(Some(answer.claimed))
    }

    /// Completes a claimed evaluation whose result has become known since it was asked for, or was known all along but
    /// not to be used before a worker's claim bound the study to a build; false if it is to be computed.
    async fn complete_known(
        self: &Arc<Self>,
        worker: &WorkerIdentity,
        claim: &Claim,
        key: &String,
    ) -> Result<bool, CoordinatorError> {
        let machine = self.machine(&claim.study).await?;
        let bound_to = (worker.build.clone(), worker.instruction_set.clone());
        let within = machine.starts_programs(claim.request.step);
        let within = within.then_some(&claim.study);
        let keys = std::slice::from_ref(key);
        let known = self.store.known(keys, &bound_to, within).await?;
        let Some(known) = known.into_iter().flatten().next() else {
            return Ok(false);
        };
        let mut payer = worker.clone();
        if let Some(id) = known.worker {
            payer.id = id;
        }
        let report = AcceptedReport {
            evaluation: claim.evaluation.clone(),
            fence: claim.fence,
            worker: payer,
            judgement: machine.judge(&claim.request, &known.outcome)?,
            outcome: known.outcome,
            cached_from: Some(known.evaluation),
        };
        if let Reported::Stored { restart, .. } = self.store.accept_result(report).await? {
            self.follow_result(restart);
        }
        Ok(true)
    }

    /// Takes a report. The step, if the batch is complete now, follows in the background.
    #[instrument(skip_all, fields(%evaluation, worker = %report.worker.id, fence = report.fence, study = field::Empty))]
    pub async fn report(
        self: &Arc<Self>,
        evaluation: EvaluationId,
        report: ReportRequest<Value>,
    ) -> Result<Reported, CoordinatorError> {
        let this = Arc::clone(self);
        to_its_end(async move { this.take_report(evaluation, report).await }).await
    }

    async fn take_report(
        self: &Arc<Self>,
        evaluation: EvaluationId,
        report: ReportRequest<Value>,
    ) -> Result<Reported, CoordinatorError> {
        let Some(asked) = self.store.asked(&evaluation).await? else {
            return Ok(Reported::Unknown);
        };
        Span::current().record("study", field::display(&asked.study));
        let machine = self.machine(&asked.study).await?;
        let (outcome, nonsense) = match serde_json::from_value::<Outcome>(report.outcome) {
            Ok(outcome) => machine.checked(&asked.request, &outcome)?,
            Err(fault) => {
                let reason = fault.to_string();
                let status = OutcomeStatus::InvalidResult {
                    reason: reason.clone(),
                };
                (Outcome::without_values(status), Some(reason))
            }
        };
        let worker = report.worker;
        let given_up = matches!(
            outcome.status,
            OutcomeStatus::Cancelled | OutcomeStatus::Lost
        );
        // Only a study that is being cancelled has cancelled results: any other evaluation is tried again, as after nonsense.
        let retried = nonsense.is_some() || given_up;
        if let Some(reason) = nonsense {
            warn!(reason, "a worker reported nonsense");
        }
        let fence = report.fence;
        let report = AcceptedReport {
            evaluation: evaluation.clone(),
            fence,
            worker,
            judgement: machine.judge(&asked.request, &outcome)?,
            outcome,
            cached_from: None,
        };
        let reported = if retried {
            let attempts = self.config.attempts;
            self.store.reject_result(report, attempts).await?
        } else {
            self.store.accept_result(report).await?
        };
        match &reported {
            Reported::Stored { status, restart } => {
                info!(restart = restart.map(|id| id.0), status, "reported");
                self.follow_result(*restart);
            }
            Reported::PutBack => self.announce(),
            Reported::Stale => {
                info!("refused a stale report");
            }
            Reported::Repeated { .. } | Reported::Unknown => {}
        }
        Ok(reported)
    }

    /// A stored result is news; it may have queued a band; and the optimiser that waits for it is stepped.
    fn follow_result(self: &Arc<Self>, restart: Option<RestartId>) {
        self.announce();
        if let Some(restart) = restart {
            self.advance_in_background(restart);
        }
    }

    /// Gives an evaluation back; false where the fence does not hold.
    pub async fn release(&self, evaluation: &EvaluationId, fence: i64) -> Result<bool, StoreError> {
        let released = self.store.release(evaluation, fence).await?;
        if released {
            self.announce();
        }
        Ok(released)
    }
}

/// Carries work out even where the request that asked for it goes away meanwhile: a worker may die between the moment in
/// which its result is stored and that in which the optimiser's step is begun, which nobody else would begin.
async fn to_its_end<T: Send + 'static>(work: impl Future<Output = T> + Send + 'static) -> T {
    match tokio::spawn(work.in_current_span()).await {
        Ok(done) => done,
        // It was not cancelled: nobody else has its handle.
        Err(panic) => std::panic::resume_unwind(panic.into_panic()),
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::*;

    #[tokio::test]
    async fn work_ends_though_its_request_goes_away() {
        let (stored, result_is_stored) = oneshot::channel::<()>();
        let (stepped, step_is_begun) = oneshot::channel::<()>();
        let work = to_its_end(async {
            // The moment in which the worker dies.
            result_is_stored.await.unwrap();
            stepped.send(()).unwrap();
        });
        // Begun and waiting when its caller is dropped.
        let answered = tokio::time::timeout(Duration::from_millis(20), work).await;
        assert!(answered.is_err());
        stored.send(()).unwrap();
        let begun = tokio::time::timeout(Duration::from_secs(10), step_is_begun).await;
        assert_eq!(begun.unwrap(), Ok(()));
    }
}
