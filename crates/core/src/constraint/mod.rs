//! What vertices are not free to do. Pins are zero inverse masses in [`System`](crate::system::System); walls are here.

mod wall;

pub use wall::Wall;
