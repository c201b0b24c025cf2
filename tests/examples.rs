//! Examples of the Rust crates run to their end, each with its own check of what comes out.

#[path = "../crates/core/examples/arrays.rs"]
mod arrays;
#[path = "../crates/core/examples/observer.rs"]
mod observer;
#[path = "../crates/core/examples/own_term.rs"]
mod own_term;
#[path = "../crates/scene/examples/structs.rs"]
mod structs;

#[test]
fn a_system_made_from_arrays_hangs() {
    arrays::main().unwrap();
}

#[test]
fn an_observer_sees_the_apex() {
    observer::main();
}

#[test]
fn a_term_of_ones_own_is_stepped_by_explicit_and_implicit_schemes() {
    own_term::main().unwrap();
}

#[test]
fn a_scene_made_of_structs_bends() {
    structs::main().unwrap();
}
