//! What every method is to the door in [`state`](super::state).

use super::{
    contract::{Ask, AskKind, Told},
    descent::DescentOptions,
    differences::Differences,
    linearisation::Linearisation,
    options::GradientSource,
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

    /// Takes the answers where a point to which they lead comes from another mesh than the values at the iterate. Points that
    /// are each for themselves have no other.
    fn tell_of_another_mesh(&mut self, told: &[Told]) {
        self.tell(told);
    }

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

    /// The options of a method that follows gradients.
    fn descent(&self) -> Option<&DescentOptions> {
        None
    }

    /// Points that it will ask for if the one that is out becomes the iterate, as far as its values do not matter: those of
    /// its differences.
    fn speculate(&self) -> Vec<Ask> {
        let (Some(here), Some(options), [ask]) = (self.here(), self.descent(), &self.asks()[..])
        else {
            return Vec::new();
        };
        if options.gradient != GradientSource::Differences || ask.kind == AskKind::Gradient {
            return Vec::new();
        }
        Differences::new(
            &here.problem,
            &ask.x,
            options.difference_step,
            options.least_difference_step,
        )
        .points(&ask.x)
        .into_iter()
        .map(|x| here.ask(AskKind::Gradient, x, false))
        .collect()
    }

    /// Pairs of made-up answers to the one point that is out. Where both answers of a pair lead to the same points, their
    /// values do not matter for these: see [`speculate`](super::speculate).
    fn alike(&self) -> Vec<[Told; 2]> {
        Vec::new()
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
