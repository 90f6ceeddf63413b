//! salp-worker
