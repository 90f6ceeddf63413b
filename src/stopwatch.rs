//! The clock that the core does not have: seconds by phase.

use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};
use salp_core::equilibrium::{Observer, Phase};
use serde_json::{Value, json};

/// Wall seconds by phase, from the first phase on.
#[derive(Debug)]
pub struct Stopwatch {
    started: Instant,
    cpu_at_start: f64,
    phase: Option<(Phase, Instant)>,
    set_up: f64,
    assembly: f64,
    factorisation: f64,
    adjoint: f64,
    measures: f64,
    contact: f64,
}

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        Self {
            started: Instant::now(),
            cpu_at_start: cpu_seconds(),
            phase: None,
            set_up: 0.0,
            assembly: 0.0,
            factorisation: 0.0,
            adjoint: 0.0,
            measures: 0.0,
            contact: 0.0,
        }
    }

    fn end_phase(&mut self) {
        if let Some((phase, since)) = self.phase.take() {
            let seconds = match phase {
                Phase::SetUp => &mut self.set_up,
                Phase::Assembly => &mut self.assembly,
                Phase::Factorisation => &mut self.factorisation,
                Phase::Adjoint => &mut self.adjoint,
                Phase::Measures => &mut self.measures,
                Phase::Contact => &mut self.contact,
            };
            *seconds += since.elapsed().as_secs_f64();
        }
    }

    /// The `seconds` of an answer. `forward` is everything but the adjoint.
    pub fn document(mut self) -> Value {
        self.end_phase();
        let wall = self.started.elapsed().as_secs_f64();
        json!({
            "wall": wall,
            "cpu": cpu_seconds() - self.cpu_at_start,
            "set_up": self.set_up,
            "assembly": self.assembly,
            "factorisation": self.factorisation,
            "contact": self.contact,
            "measures": self.measures,
            "forward": wall - self.adjoint,
            "adjoint": self.adjoint,
        })
    }
}

impl Observer for Stopwatch {
    fn enter(&mut self, phase: Phase) {
        self.end_phase();
        self.phase = Some((phase, Instant::now()));
    }
}

/// CPU seconds of this process.
pub fn cpu_seconds() -> f64 {
    seconds(ClockId::ProcessCPUTime)
}

/// CPU seconds of this thread.
pub fn thread_cpu_seconds() -> f64 {
    seconds(ClockId::ThreadCPUTime)
}

fn seconds(clock: ClockId) -> f64 {
    let time = clock_gettime(clock);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
