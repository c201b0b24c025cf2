//! Nothing to do: without a build script cargo does not ask for features of build dependencies.

fn main() {}
