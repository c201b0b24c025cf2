//! `pliant schema`.

use clap::{Args, ValueEnum};

/// `pliant schema`.
#[derive(Args, Clone, Debug)]
pub(crate) struct SchemaArguments {
    /// Format: json (the JSON schema) or markdown (the reference page)
    #[arg(long, value_name = "FORMAT", default_value = "json", hide_possible_values = true)]
    pub(crate) format: SchemaFormat,
}

/// How the format of scenes is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemaFormat {
    /// JSON schema
    Json,
    /// Reference page
    Markdown,
}
