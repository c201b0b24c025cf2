//! Integration tests of the program and the library.

mod cli;
