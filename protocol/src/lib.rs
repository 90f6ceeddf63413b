//! What coordinator, workers and clients say to each other over HTTP: ids and wire types, nothing else.
//!
//! A worker *claims* an evaluation and gets it with a *fence*, a number that grows with every claim. It renews its lease
//! by *heartbeats* and *reports* the outcome; heartbeat and report must carry the fence, and one that is no longer the
//! latest is refused, so a worker that was thought dead can never overwrite what another one did.

pub mod csv;
pub mod event;
pub mod id;
pub mod problem;
pub mod results;
pub mod study;
pub mod work;

pub use event::{Event, EventPage};
pub use id::{EvaluationId, StudyId, WorkerId};
pub use problem::Problem;
pub use results::{
    Axis, BestSoFar, Candidate, Curve, CurvePoint, EvaluationRow, LedgerPage, RestartCurve,
};
pub use study::{
    BandCounts, Best, Counts, GuessCounts, RestartState, RestartView, StepState, StepView,
    StudyCreated, StudyPage, StudyState, StudyView,
};
pub use work::{
    Claim, ClaimRequest, Directive, HeartbeatAnswer, HeartbeatRequest, ReleaseRequest,
    ReportAnswer, ReportRequest, WorkerIdentity, WorkerView,
};
