//! What restarts are worth: chances, costs and bands of a method, from the runs that it made.
//!
//! A run is a [`Trace`]: the best value so far (minimised) against what was spent. All statements are about runs that are
//! independent of each other and drawn from one population, the starts of a study; bands come from drawing runs with
//! replacement out of those that were made (bootstrap), by a seeded stream, so that the same runs give the same bands.
//!
//! | what | where | source |
//! |---|---|---|
//! | best of N against cost, with a band | [`best_of_n`] | bootstrap over runs; in closed form [`quantile_of_best`] |
//! | chance of a run, expected cost to a target | [`ExpectedCost`] | COCO: Hansen et al. 2021, Optim. Methods Softw. 36(1) |
//! | data and performance profiles | [`Profiles`] | More and Wild 2009, SIAM J. Optim. 20(1); Dolan and More 2002 |

mod best_of_n;
mod expected_cost;
mod profile;
mod resampling;
mod trace;

pub use best_of_n::{best_of_n, quantile_of_best};
pub use expected_cost::{CostRatio, ExpectedCost, ratio};
pub use profile::{Profile, Profiles, Solved, profile_target};
pub use resampling::{Resampling, quantile};
pub use trace::{Sample, Trace};
