//! The one door to every optimiser.

use serde::{Deserialize, Serialize};

use super::{
    cma_es::CmaEs,
    contract::{Ask, Told},
    exchange::Exchange,
    gcmma::Gcmma,
    method::Method,
    mmfd::Mmfd,
    options::OptimiserOptions,
    point::Point,
    problem::{Problem, StartError},
    random_search::RandomSearch,
    sqp::Sqp,
    stop::StopReason,
    sweep::Sweep,
};
use crate::fault::Faults;

/// A run between two evaluations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum OptimiserState {
    /// Modified method of feasible directions.
    Mmfd(Box<Mmfd>),
    /// Moving asymptotes.
    Gcmma(Box<Gcmma>),
    /// Sequential quadratic programming.
    Sqp(Box<Sqp>),
    /// Evolution strategy with covariance matrix adaptation.
    CmaEs(Box<CmaEs>),
    /// Points drawn at random.
    RandomSearch(RandomSearch),
    /// Sequences of letters, exchanged.
    Exchange(Exchange),
    /// A list of points.
    Sweep(Sweep),
}

/// What a step leads to.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The run after the step.
    pub state: OptimiserState,
    /// Points wanted next, independent of each other; none when the run is over.
    pub asks: Vec<Ask>,
    /// Why the run is over, if it is.
    pub done: Option<StopReason>,
}

/// Opens a run from `x0`, which is moved into the bounds.
pub fn start(
    options: OptimiserOptions,
    problem: Problem,
    mut x0: Vec<f64>,
) -> Result<(OptimiserState, Vec<Ask>), StartError> {
    problem.check(&x0)?;
    let mut faults = Faults::default();
    options.faults("optimiser", &mut faults);
    faults.check(()).map_err(StartError::Options)?;
    problem.clip(&mut x0);
    let state = match options {
        OptimiserOptions::Mmfd(options) => {
            OptimiserState::Mmfd(Box::new(Mmfd::start(options, problem, x0)))
        }
        OptimiserOptions::Gcmma(options) => {
            OptimiserState::Gcmma(Box::new(Gcmma::start(options, problem, x0)))
        }
        OptimiserOptions::Sqp(options) => {
            OptimiserState::Sqp(Box::new(Sqp::start(options, problem, x0)))
        }
        OptimiserOptions::CmaEs(options) => {
            OptimiserState::CmaEs(Box::new(CmaEs::start(options, problem, &x0)?))
        }
        OptimiserOptions::RandomSearch(options) => {
            OptimiserState::RandomSearch(RandomSearch::start(options, problem, x0))
        }
        OptimiserOptions::Exchange(options) => {
            OptimiserState::Exchange(Exchange::start(options, problem)?)
        }
        OptimiserOptions::Sweep(options) => {
            OptimiserState::Sweep(Sweep::start(options, problem, x0)?)
        }
    };
    let asks = state.asks();
    Ok((state, asks))
}

/// Goes on with the answers to the asks of the last step, in their order.
///
/// An answer that is missing, of the wrong length or not finite counts as [`Told::Failed`]; surplus ones are ignored.
/// A finished run stays finished.
pub fn step(state: &OptimiserState, told: &[Told]) -> Step {
    moved(state, |method| method.tell(told))
}

/// As [`step`], where it leads to a point that was evaluated on another mesh than the iterate. The two are compared all the
/// same, which is meant for far points: their values differ by more than meshes do. Best point and stop tests begin anew with
/// the new iterate, so that none spans the change.
pub fn step_on_another_mesh(state: &OptimiserState, told: &[Told]) -> Step {
    moved(state, |method| method.tell_of_another_mesh(told))
}

/// Asks for the iterate again because the model's values have changed their meaning (a new mesh plan), and forgets what
/// rests on the old ones: the best point, conjugacy, counts of consecutive small changes, so that no stop test spans the
/// change. Step lengths, scales and learnt curvature stay: they only guess at the next step. What was asked before is
/// void. A finished run, a sweep, a random search and an exchange descent are left as they are.
pub fn rebase(state: &OptimiserState) -> Step {
    moved(state, |method| method.rebase())
}

/// Shows the pending points to what can refuse a design by its geometry alone, before any analysis: `refuses` says by how
/// much a design breaks it, if it does. Methods that draw their points draw others, at no cost; all others are left as they
/// are. To be called with every new batch.
pub fn screen(state: &OptimiserState, mut refuses: impl FnMut(&[f64]) -> Option<f64>) -> Step {
    moved(state, |method| method.screen(&mut refuses))
}

fn moved(state: &OptimiserState, by: impl FnOnce(&mut dyn Method)) -> Step {
    let mut state = state.clone();
    by(state.method_mut());
    Step {
        asks: state.asks(),
        done: state.done(),
        state,
    }
}

impl OptimiserState {
    pub(super) fn method(&self) -> &dyn Method {
        match self {
            Self::Mmfd(mmfd) => &**mmfd,
            Self::Gcmma(gcmma) => &**gcmma,
            Self::Sqp(sqp) => &**sqp,
            Self::CmaEs(cma_es) => &**cma_es,
            Self::RandomSearch(search) => search,
            Self::Exchange(exchange) => exchange,
            Self::Sweep(sweep) => sweep,
        }
    }

    fn method_mut(&mut self) -> &mut dyn Method {
        match self {
            Self::Mmfd(mmfd) => &mut **mmfd,
            Self::Gcmma(gcmma) => &mut **gcmma,
            Self::Sqp(sqp) => &mut **sqp,
            Self::CmaEs(cma_es) => &mut **cma_es,
            Self::RandomSearch(search) => search,
            Self::Exchange(exchange) => exchange,
            Self::Sweep(sweep) => sweep,
        }
    }

    /// The points whose answers the run waits for.
    pub fn asks(&self) -> Vec<Ask> {
        self.method().asks()
    }

    /// Why the run is over, if it is.
    pub fn done(&self) -> Option<StopReason> {
        self.method().done()
    }

    /// The current iterate with its values, once it has some; a sweep's is its best point.
    pub fn iterate(&self) -> Option<&Point> {
        self.method().iterate()
    }

    /// The best point evaluated: of those within the violation tolerance the one with the lowest objective, else the
    /// one with the least violation. After a [`rebase`] it counts from there.
    pub fn best(&self) -> Option<&Point> {
        self.method().best()
    }

    /// Iterations completed.
    pub fn iteration(&self) -> usize {
        self.method().iteration()
    }

    /// Whether the pending asks open a new iteration: the moment at which a [`rebase`] loses no work.
    pub fn at_iteration_boundary(&self) -> bool {
        self.method().at_iteration_boundary()
    }

    /// Points answered, those of differences included, gradients at points with known values excluded.
    pub fn analyses(&self) -> usize {
        self.method().analyses()
    }

    /// Gradients had: from the model, or from a batch of differences.
    pub fn gradients(&self) -> usize {
        self.method().gradients()
    }

    /// Lagrange multipliers of the last direction, one per constraint (d objective / d constraint, sign reversed;
    /// of either sign for equalities).
    pub fn multipliers(&self) -> Vec<f64> {
        self.method().multipliers()
    }
}
