//! What every method is to the door in [`state`](super::state).

use super::{
    contract::{Ask, Told},
    linearisation::Linearisation,
    point::Point,
    stop::StopReason,
};

/// Says by how much a design breaks what its geometry alone tells, if it does.
pub(super) type Refuses<'a> = dyn FnMut(&[f64]) -> Option<f64> + 'a;

/// A run of one method between two evaluations.
pub(super) trait Method {
    /// The points whose answers the run waits for; none when it is over.
    fn asks(&self) -> Vec<Ask>;

    /// Takes the answers to the pending asks, in their order. A finished run stays finished.
    fn tell(&mut self, told: &[Told]);

    /// Asks for the iterate again and forgets what rests on its old values. Points that are each for themselves need none
    /// of it.
    fn rebase(&mut self) {}

    /// Shows the points that it wants to what can refuse a design before any analysis. A method that draws its points draws
    /// others, or does without; one that walks to them, as here, evaluates what it has asked for.
    fn screen(&mut self, _refuses: &mut Refuses<'_>) {}

    /// Why the run is over, if it is.
    fn done(&self) -> Option<StopReason>;

    /// Where a method that follows gradients stands; what follows is read there. Others say it themselves.
    fn here(&self) -> Option<&Linearisation> {
        None
    }

    /// The best point evaluated.
    fn best(&self) -> Option<&Point> {
        self.here()?.best.as_ref()
    }

    /// The current iterate with its values, once it has some; the best point where there is none.
    fn iterate(&self) -> Option<&Point> {
        match self.here() {
            Some(here) => here.iterate.as_ref(),
            None => self.best(),
        }
    }

    /// Iterations completed.
    fn iteration(&self) -> usize {
        self.here().map_or(0, |here| here.iteration)
    }

    /// Whether the pending asks open a new iteration.
    fn at_iteration_boundary(&self) -> bool {
        self.here().is_some_and(|here| here.boundary) && self.done().is_none()
    }

    /// Points answered, gradients at points with known values excluded.
    fn analyses(&self) -> usize {
        self.here().map_or(0, |here| here.analyses)
    }

    /// Gradients had.
    fn gradients(&self) -> usize {
        self.here().map_or(0, |here| here.gradients)
    }

    /// Lagrange multipliers, one per constraint; empty where the method has none.
    fn multipliers(&self) -> Vec<f64> {
        Vec::new()
    }
}
