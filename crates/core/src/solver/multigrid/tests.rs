//! Facts about the V-cycle.
