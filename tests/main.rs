//! The integration tests: measurements of the whole program against independent references.
//!
//! Each test names the feature of the lecture it belongs to and the case of the verification plan (A
//! integrators, B materials, C finite elements, D extreme cases) that its numbers come from. No number here
//! was produced by this program: they are closed forms, or were computed by independent codes in extended
//! precision. Only `counters` and `element_record` compare it with what it gave before.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![allow(clippy::excessive_precision, reason = "references keep the digits they were computed to")]

mod support;

mod architecture;
mod attachment_limit;
mod attachments;
mod bending;
mod browser_bits;
mod changing_stencils;
mod checkpoints;
mod cli;
mod contact_surveys;
mod counters;
mod damping;
mod determinism;
mod element_record;
mod engine;
mod examples;
mod integrators;
mod measuring;
mod membranes;
mod numbering;
mod properties;
mod scenes;
mod solids;
mod springs;
mod steering;
mod study;
mod warnings;
