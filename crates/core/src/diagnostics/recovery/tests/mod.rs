//! Recovered stresses against exact ones and against published problems.

mod exact;
mod problem;
mod published;
