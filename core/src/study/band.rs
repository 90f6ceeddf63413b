//! Error bands: the objective of a design that became the best so far, on a second mesh, and what the two values say.

use super::result::EvaluationRequest;
use super::spec::Study;

impl Study {
    /// What is asked for the error band of an evaluation; `None` where the study wants none, of programs, which have no
    /// mesh, below the study's own fidelity, and of what is itself a band.
    pub fn band(&self, request: &EvaluationRequest) -> Option<EvaluationRequest> {
        let step = self.steps.get(request.step)?;
        let wanted = self.error_bands
            && step.model.finite_elements().is_some()
            && !request.second_mesh
            && request.fidelity.is_none();
        wanted.then(|| EvaluationRequest {
            second_mesh: true,
            want_gradient: false,
            ..request.clone()
        })
    }
}

/// Half the width of the band over the difference of the two values: Roache's 1.25 at order one, for elements twice as large.
const BAND_FACTOR: f64 = 1.25;

/// Half the width of the band about an objective, from its value on the second mesh, which has half as many elements each way.
pub fn band_half_width(own: f64, second: f64) -> f64 {
    BAND_FACTOR * (own - second).abs()
}
