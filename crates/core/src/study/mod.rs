//! Studies: error against run time, and the charts that show it.

pub mod plot;
