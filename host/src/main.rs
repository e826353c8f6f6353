//! The `tonus` program.
fn main() {}
