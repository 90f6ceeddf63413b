//! The one executable: `salp`.

fn main() {}
