//! salp-protocol
