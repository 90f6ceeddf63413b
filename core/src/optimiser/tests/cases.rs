//! The published problems, by name.

pub(super) use crate::optimiser::published::{Case, all, formula};

/// The problem of this name.
pub(super) fn named(id: &str) -> Case {
    all()
        .into_iter()
        .find(|case| case.id == id)
        .expect("a known problem")
}
