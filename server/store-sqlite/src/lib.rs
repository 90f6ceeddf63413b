//! salp-store-sqlite
