//! Verification: published and closed-form problems with their observed orders, symmetries, and the gradient.
//!
//! "Verified" is said of numerical error alone: that the equations of the model are solved. Whether a silicone obeys them is
//! a question to experiments.
//!
//! A problem is defined once, here: `salp verify` runs it with bounds, tests run it on coarse meshes, and the tests of
//! `tests/verification` write its mesh and scene to files and solve them as a user would.

mod bench;
mod chambers;
mod contact;
pub mod cooks_membrane;
pub mod designs;
mod extremes;
pub mod homogeneous;
pub mod optimisers;
mod problem;
pub mod rivlin_flexure;
#[cfg(test)]
mod tests;
pub mod thick_cylinder;

use bench::Bench;
pub use bench::{CpuClock, Line};
pub use extremes::{Against, Expected, Extreme, ExtremeLine, extremes, run_extreme};
pub use problem::{Drive, MESH_FILE, Problem, Solved, Unsolved, file_kind};

use crate::mesh::ElementKind;

/// A verification problem by its name.
#[derive(Clone, Copy)]
pub struct NamedProblem {
    /// Its name.
    pub name: &'static str,
    /// What it checks.
    pub about: &'static str,
    /// The elements on which it runs.
    pub elements: &'static [ElementKind],
    run: fn(&mut Bench<'_>, ElementKind),
}

const QUADS: &[ElementKind] = &[ElementKind::Quad9, ElementKind::Quad4];
const ALL: &[ElementKind] = &[ElementKind::Quad9, ElementKind::Quad4, ElementKind::Tri7];

/// All problems.
pub const PROBLEMS: [NamedProblem; 13] = [
    NamedProblem {
        name: "thick-cylinder",
        about: "incompressible neo-Hookean cylinder under inner pressure",
        elements: ALL,
        run: thick_cylinder::run_neo_hookean,
    },
    NamedProblem {
        name: "yeoh-cylinder",
        about: "the same of a Yeoh law",
        elements: ALL,
        run: thick_cylinder::run_yeoh,
    },
    NamedProblem {
        name: "rivlin-flexure",
        about: "a block bent up to a closed ring",
        elements: ALL,
        run: rivlin_flexure::run,
    },
    NamedProblem {
        name: "cooks-membrane",
        about: "a tapered panel in shear and bending",
        elements: ALL,
        run: cooks_membrane::run,
    },
    NamedProblem {
        name: "hertz",
        about: "a disc pressed between two rigid plates",
        elements: QUADS,
        run: contact::run_hertz,
    },
    NamedProblem {
        name: "pressed-blocks",
        about: "two blocks whose meshes do not match press evenly",
        elements: ALL,
        run: contact::run_pressed_blocks,
    },
    NamedProblem {
        name: "crushed-tube",
        about: "a thin tube crushed between rigid plates",
        elements: QUADS,
        run: contact::run_crushed_tube,
    },
    NamedProblem {
        name: "collapsed-tube",
        about: "a thin tube sucked flat until its sides touch",
        elements: QUADS,
        run: contact::run_collapsed_tube,
    },
    NamedProblem {
        name: "homogeneous",
        about: "stretch and shear of distorted elements, every law",
        elements: ALL,
        run: homogeneous::run,
    },
    NamedProblem {
        name: "retraced-channel",
        about: "one channel encloses nothing",
        elements: QUADS,
        run: chambers::retraced,
    },
    NamedProblem {
        name: "mirror",
        about: "a unit symmetric about mid-height",
        elements: QUADS,
        run: chambers::mirror,
    },
    NamedProblem {
        name: "overlap-hold",
        about: "overlap encloses twice hold",
        elements: QUADS,
        run: chambers::overlap_is_twice_hold,
    },
    NamedProblem {
        name: "gradient",
        about: "the adjoint against central differences",
        elements: QUADS,
        run: chambers::gradient,
    },
];

impl NamedProblem {
    /// Runs on one element; its bounds are divided by `tighten`.
    pub fn run(&self, element: ElementKind, tighten: f64, clock: &mut dyn CpuClock) -> Vec<Line> {
        let mut bench = Bench::new(clock, self.name, element, tighten);
        (self.run)(&mut bench, element);
        bench.finish()
    }
}
