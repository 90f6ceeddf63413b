//! Documents as JSON values: parsing, overriding a field, and reading with every fault at once.

#[cfg(test)]
pub(crate) mod mutate;
mod node;
mod parse;
mod set;
mod sweep;

pub(crate) use node::{IS_REQUIRED, all};
pub use node::{Node, Object, read};
pub use parse::{parse_json, parse_toml};
pub use set::set;
pub use sweep::{P_OVER_MU, Sweep, shown};
