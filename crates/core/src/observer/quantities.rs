//! Sets of frame quantities.

use std::fmt;
use std::ops::{BitOr, BitOrAssign};

/// Set of quantities that a [`Frame`](super::Frame) has or an [`Observer`](super::Observer) reads.
///
/// ```
/// use pliant::observer::Quantities;
///
/// let read = Quantities::DIAGNOSTICS | Quantities::REACTIONS;
/// assert!(read.contains(Quantities::REACTIONS) && !read.contains(Quantities::POINTS));
/// assert_eq!(read.without(Quantities::REACTIONS).to_string(), "diagnostics");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantities(u16);

/// Names, in bit order.
const NAMES: [&str; 9] = [
    "state",
    "diagnostics",
    "states of elements",
    "states of points",
    "reactions",
    "contacts",
    "stress at vertices",
    "error of the stress",
    "contact tractions",
];

impl Quantities {
    /// Empty set.
    pub const NONE: Quantities = Quantities(0);
    /// Positions and velocities; every frame has them.
    pub const STATE: Quantities = Quantities(1);
    /// Energies and momenta, [`Frame::diagnostics`](super::Frame::diagnostics).
    pub const DIAGNOSTICS: Quantities = Quantities(1 << 1);
    /// Deformation and stress of elements, [`Frame::elements`](super::Frame::elements).
    pub const ELEMENTS: Quantities = Quantities(1 << 2);
    /// Deformation and stress at points, [`Frame::points`](super::Frame::points).
    pub const POINTS: Quantities = Quantities(1 << 3);
    /// Reaction forces of pins and walls, [`Frame::reactions`](super::Frame::reactions).
    pub const REACTIONS: Quantities = Quantities(1 << 4);
    /// Surfaces in contact, [`Frame::contacts`](super::Frame::contacts).
    pub const CONTACTS: Quantities = Quantities(1 << 5);
    /// Recovered stress at vertices, [`Frame::nodal_stress`](super::Frame::nodal_stress).
    pub const NODAL_STRESS: Quantities = Quantities(1 << 6);
    /// Estimated error of the stress of elements, [`Frame::stress_error`](super::Frame::stress_error).
    pub const STRESS_ERROR: Quantities = Quantities(1 << 7);
    /// Pressure and friction of contact at vertices,
    /// [`Frame::contact_tractions`](super::Frame::contact_tractions).
    pub const CONTACT_TRACTIONS: Quantities = Quantities(1 << 8);

    /// True if the set contains all of `others`.
    pub const fn contains(self, others: Quantities) -> bool {
        self.0 & others.0 == others.0
    }

    /// Returns the set without `others`.
    pub const fn without(self, others: Quantities) -> Quantities {
        Quantities(self.0 & !others.0)
    }

    /// Returns the set if `condition` holds, else the empty set.
    pub const fn only_if(self, condition: bool) -> Quantities {
        if condition { self } else { Quantities::NONE }
    }

    /// True if the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl BitOr for Quantities {
    type Output = Quantities;

    fn bitor(self, others: Quantities) -> Quantities {
        Quantities(self.0 | others.0)
    }
}

impl BitOrAssign for Quantities {
    fn bitor_assign(&mut self, others: Quantities) {
        self.0 |= others.0;
    }
}

/// Builds the union.
impl FromIterator<Quantities> for Quantities {
    fn from_iter<I: IntoIterator<Item = Quantities>>(sets: I) -> Quantities {
        sets.into_iter().fold(Quantities::NONE, BitOr::bitor)
    }
}

/// Lists the names, separated by commas.
impl fmt::Display for Quantities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = NAMES.iter().enumerate().filter(|(bit, _)| self.0 & (1 << bit) != 0);
        f.write_str(&names.map(|(_, name)| *name).collect::<Vec<_>>().join(", "))
    }
}
