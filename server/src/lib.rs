//! salp-server
