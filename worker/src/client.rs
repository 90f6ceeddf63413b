//! The typed client of the API.

use std::time::Duration;

use salp_protocol::problem::Problem;
use salp_protocol::{
    Axis, Candidate, Claim, ClaimRequest, Curve, EvaluationId, EvaluationRow, Event, EventPage,
    HeartbeatAnswer, HeartbeatRequest, LedgerPage, ReleaseRequest, ReportAnswer, ReportRequest,
    RestartView, StudyCreated, StudyId, StudyPage, StudyView, WorkerView,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use ureq::http::Response;
use ureq::{Agent, Body};

/// Longest answer that is read, bytes.
const LONGEST_ANSWER: u64 = 1 << 30;

/// Why a request came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No answer: worth trying again.
    #[error("cannot reach {url}: {source}")]
    Unreachable {
        /// Where.
        url: String,
        /// Why.
        source: Box<ureq::Error>,
    },
    /// The coordinator says no.
    #[error("{0}")]
    Refused(Box<Problem>),
    /// An answer that is none of the API's.
    #[error("{url} answered {status} with what no coordinator says: {detail}")]
    Strange {
        /// Where.
        url: String,
        /// HTTP status.
        status: u16,
        /// What was wrong.
        detail: String,
    },
}

impl ClientError {
    /// The kind of problem, where the coordinator said no.
    pub fn problem(&self) -> Option<&str> {
        match self {
            Self::Refused(problem) => Some(&problem.kind),
            _ => None,
        }
    }

    /// Whether the same request may succeed later.
    pub fn is_passing(&self) -> bool {
        match self {
            Self::Unreachable { .. } => true,
            Self::Refused(problem) => problem.status >= 500,
            Self::Strange { status, .. } => *status >= 500,
        }
    }
}

/// A client; cheap to clone, usable from many threads.
#[derive(Clone, Debug)]
pub struct Client {
    url: String,
    authorisation: Option<String>,
    agent: Agent,
}

impl Client {
    /// A client of the coordinator at `http://host:port`. Requests that are not held back by the coordinator end
    /// after `timeout`.
    pub fn new(url: &str, token: Option<&str>, timeout: Duration) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .proxy(None)
            .timeout_connect(Some(timeout.min(Duration::from_secs(5))))
            .timeout_global(Some(timeout))
            .build();
        Self {
            url: url.trim_end_matches('/').to_owned(),
            authorisation: token.map(|token| format!("Bearer {}", token.trim())),
            agent: Agent::new_with_config(config),
        }
    }

    /// Address of the coordinator.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Submits a study.
    pub fn submit(
        &self,
        document: &Value,
        idempotency_key: Option<&str>,
    ) -> Result<StudyCreated, ClientError> {
        let url = self.at("/v1/studies");
        let mut request = self.agent.post(&url);
        if let Some(authorisation) = &self.authorisation {
            request = request.header("authorization", authorisation);
        }
        if let Some(key) = idempotency_key {
            request = request.header("idempotency-key", key);
        }
        read(&url, request.send_json(document))
    }

    /// A page of studies, latest first.
    pub fn studies(&self, cursor: Option<&str>) -> Result<StudyPage, ClientError> {
        let cursor = cursor.map_or_else(String::new, |cursor| format!("?cursor={cursor}"));
        self.get(&format!("/v1/studies{cursor}"))
    }

    /// A study.
    pub fn study(&self, id: &StudyId) -> Result<StudyView, ClientError> {
        self.get(&format!("/v1/studies/{id}"))
    }

    /// A study's document as submitted.
    pub fn document(&self, id: &StudyId) -> Result<Value, ClientError> {
        self.get(&format!("/v1/studies/{id}/document"))
    }

    /// Cancels, pauses or resumes a study: `command` is the last word of the path.
    pub fn command(&self, id: &StudyId, command: &str) -> Result<StudyView, ClientError> {
        self.post(&format!("/v1/studies/{id}/{command}"), &Value::Null)
    }

    /// Restarts of a study.
    pub fn restarts(&self, id: &StudyId) -> Result<Vec<RestartView>, ClientError> {
        self.get(&format!("/v1/studies/{id}/restarts"))
    }

    /// Brings back a restart that the competition of its step stopped.
    pub fn resume_restart(
        &self,
        id: &StudyId,
        step: usize,
        index: usize,
    ) -> Result<RestartView, ClientError> {
        let path = format!("/v1/studies/{id}/steps/{step}/restarts/{index}/resume");
        self.post(&path, &Value::Null)
    }

    /// Curve of a study.
    pub fn curve(&self, id: &StudyId, axis: Axis) -> Result<Curve, ClientError> {
        let axis = match axis {
            Axis::Cpu => "cpu",
            Axis::Wall => "wall",
            Axis::Evaluations => "evaluations",
        };
        self.get(&format!("/v1/studies/{id}/curve?axis={axis}"))
    }

    /// The whole ledger, page by page; `outcome` adds the whole outcomes.
    pub fn evaluations(
        &self,
        id: &StudyId,
        outcome: bool,
    ) -> Result<Vec<EvaluationRow>, ClientError> {
        let mut rows = Vec::new();
        let mut cursor = String::from("0");
        loop {
            let path = format!("/v1/studies/{id}/evaluations?outcome={outcome}&cursor={cursor}");
            let page: LedgerPage = self.get(&path)?;
            rows.extend(page.evaluations);
            match page.next {
                Some(next) => cursor = next,
                None => return Ok(rows),
            }
        }
    }

    /// Candidates of a study.
    pub fn candidates(&self, id: &StudyId) -> Result<Vec<Candidate>, ClientError> {
        self.get(&format!("/v1/studies/{id}/candidates"))
    }

    /// Events after one; waits for the first up to `wait_s`, which must be below the client's timeout.
    pub fn events(&self, id: &StudyId, after: i64, wait_s: f64) -> Result<Vec<Event>, ClientError> {
        let page: EventPage = self.get(&format!(
            "/v1/studies/{id}/events?after={after}&wait={wait_s}"
        ))?;
        Ok(page.events)
    }

    /// Workers.
    pub fn workers(&self) -> Result<Vec<WorkerView>, ClientError> {
        self.get("/v1/workers")
    }

    /// Whether the coordinator is ready.
    pub fn ready(&self) -> Result<Value, ClientError> {
        self.get("/readyz")
    }

    /// Claims an evaluation; `None` if there is none.
    pub fn claim(&self, request: &ClaimRequest) -> Result<Option<Claim>, ClientError> {
        let url = self.at("/v1/claims");
        let mut response = answered(
            &url,
            self.with_token(self.agent.post(&url)).send_json(request),
        )?;
        if response.status() == 204 {
            return Ok(None);
        }
        body(&url, &mut response).map(Some)
    }

    /// Renews a lease.
    pub fn heartbeat(
        &self,
        evaluation: &EvaluationId,
        fence: i64,
    ) -> Result<HeartbeatAnswer, ClientError> {
        let request = HeartbeatRequest { fence };
        self.put(&format!("/v1/evaluations/{evaluation}/heartbeat"), &request)
    }

    /// Reports an outcome.
    pub fn report(
        &self,
        evaluation: &EvaluationId,
        report: &ReportRequest,
    ) -> Result<ReportAnswer, ClientError> {
        self.put(&format!("/v1/evaluations/{evaluation}/result"), report)
    }

    /// Gives an evaluation back.
    pub fn release(&self, evaluation: &EvaluationId, fence: i64) -> Result<(), ClientError> {
        let url = self.at(&format!("/v1/evaluations/{evaluation}/release"));
        let request = self.with_token(self.agent.put(&url));
        answered(&url, request.send_json(ReleaseRequest { fence })).map(drop)
    }

    fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    fn with_token<T>(&self, request: ureq::RequestBuilder<T>) -> ureq::RequestBuilder<T> {
        match &self.authorisation {
            Some(authorisation) => request.header("authorization", authorisation),
            None => request,
        }
    }

    fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, ClientError> {
        let url = self.at(path);
        read(&url, self.with_token(self.agent.get(&url)).call())
    }

    fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
    ) -> Result<T, ClientError> {
        let url = self.at(path);
        read(&url, self.with_token(self.agent.post(&url)).send_json(body))
    }

    fn put<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl Serialize,
    ) -> Result<T, ClientError> {
        let url = self.at(path);
        read(&url, self.with_token(self.agent.put(&url)).send_json(body))
    }
}

type Answer = Result<Response<Body>, ureq::Error>;

fn read<T: DeserializeOwned>(url: &str, answer: Answer) -> Result<T, ClientError> {
    body(url, &mut answered(url, answer)?)
}

/// An answer of success; anything else as an error.
fn answered(url: &str, answer: Answer) -> Result<Response<Body>, ClientError> {
    let mut response = answer.map_err(|source| ClientError::Unreachable {
        url: url.to_owned(),
        source: Box::new(source),
    })?;
    if response.status().is_success() {
        return Ok(response);
    }
    let problem: Problem = body(url, &mut response)?;
    Err(ClientError::Refused(Box::new(problem)))
}

fn body<T: DeserializeOwned>(url: &str, response: &mut Response<Body>) -> Result<T, ClientError> {
    let status = response.status().as_u16();
    let bytes = response
        .body_mut()
        .with_config()
        .limit(LONGEST_ANSWER)
        .read_to_vec()
        .map_err(|source| ClientError::Unreachable {
            url: url.to_owned(),
            source: Box::new(source),
        })?;
    serde_json::from_slice(&bytes).map_err(|fault| ClientError::Strange {
        url: url.to_owned(),
        status,
        detail: fault.to_string(),
    })
}
