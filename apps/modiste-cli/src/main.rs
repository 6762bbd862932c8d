//! The `modiste` command.
fn main() {}
