//! `pliant list`.

use clap::{Args, ValueEnum};

/// `pliant list`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ListArguments {
    /// Only this family
    pub(crate) family: Option<Family>,
}

/// Families that can be listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Family {
    /// Time integrators
    Integrators,
    /// Hyperelastic materials
    Materials,
    /// Well-known materials: constants, densities and their sources
    Presets,
    /// Finite elements and springs
    Elements,
    /// Meshes: generators and files
    Meshes,
    /// Output channels
    Channels,
}
