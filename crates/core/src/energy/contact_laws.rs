//! Numbers that laws of contact have, and numbers of bodies that these are made of, as derivatives know them.

/// One number for each number of the laws of contact: changes of them, or derivatives by them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactLawRates {
    /// Numbers of every two bodies `a <= b`, at `a * bodies + b`, by [`LawNumber`].
    pub pairs: Vec<[f64; 3]>,
    /// Distance from which on surfaces push where nothing shortens it [m]: areas of wires and particles go by
    /// it, and depths of walls.
    pub distance: f64,
    /// Speed below which friction grows smoothly from zero [m/s].
    pub threshold_speed: f64,
}

impl ContactLawRates {
    /// Zero, of so many bodies.
    pub fn zero(bodies: usize) -> Self {
        ContactLawRates { pairs: vec![[0.0; 3]; bodies * bodies], ..ContactLawRates::default() }
    }
}

/// Number of the law of two bodies, by its place in [`ContactLawRates::pairs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawNumber {
    /// `kappa` [Pa].
    Stiffness,
    /// `dhat`: gap from which on they push [m].
    Reach,
    /// `xi`: sum of their radii [m].
    Offset,
}

/// One number for each number of bodies that laws of contact are made of: changes of them, or derivatives by
/// them.
#[derive(Clone, Debug, PartialEq)]
pub struct LawInputRates {
    /// Rest positions, flat [m].
    pub rest: Vec<f64>,
    /// Masses of vertices [kg].
    pub masses: Vec<f64>,
    /// Young's moduli of bodies [Pa].
    pub moduli: Vec<f64>,
}

/// Number of bodies that laws of contact are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawInput {
    /// Rest position, by its coordinate.
    Rest(usize),
    /// Mass of a vertex.
    Mass(u32),
    /// Young's modulus of a body.
    Modulus(u32),
    /// [`ContactLawRates::distance`], which is made of rest positions itself.
    Distance,
}

/// Derivatives of the numbers of laws by those that they are made of; those that are not listed are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LawLinks {
    /// Number of the law of two bodies, by their place in [`ContactLawRates::pairs`].
    pub pairs: Vec<(usize, LawNumber, LawInput, f64)>,
    /// Derivatives of the distance, by coordinates of rest positions.
    pub distance: Vec<(usize, f64)>,
    /// Derivatives of the threshold speed [1/s], likewise.
    pub threshold_speed: Vec<(usize, f64)>,
}

impl LawLinks {
    /// True if no law goes by anything.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty() && self.distance.is_empty() && self.threshold_speed.is_empty()
    }

    /// Changes of the laws of so many `bodies` where the numbers that they are made of change.
    pub fn changes(&self, of: &LawInputRates, bodies: usize) -> ContactLawRates {
        let mut changes = ContactLawRates::zero(bodies);
        let along = |links: &[(usize, f64)]| links.iter().map(|(i, slope)| slope * of.rest[*i]).sum();
        changes.distance = along(&self.distance);
        changes.threshold_speed = along(&self.threshold_speed);
        for (pair, number, input, slope) in &self.pairs {
            changes.pairs[*pair][*number as usize] += slope
                * match input {
                    LawInput::Rest(i) => of.rest[*i],
                    LawInput::Mass(v) => of.masses[*v as usize],
                    LawInput::Modulus(body) => of.moduli[*body as usize],
                    LawInput::Distance => changes.distance,
                };
        }
        changes
    }

    /// Adds to derivatives by the numbers that laws are made of what those by their numbers, `rates`, make of
    /// them: the transpose of [`changes`](Self::changes).
    pub fn add_rates(&self, rates: &ContactLawRates, by: &mut LawInputRates) {
        let mut by_distance = rates.distance;
        for (pair, number, input, slope) in &self.pairs {
            *match input {
                LawInput::Rest(i) => &mut by.rest[*i],
                LawInput::Mass(v) => &mut by.masses[*v as usize],
                LawInput::Modulus(body) => &mut by.moduli[*body as usize],
                LawInput::Distance => &mut by_distance,
            } += slope * rates.pairs[*pair][*number as usize];
        }
        self.distance.iter().for_each(|(i, slope)| by.rest[*i] += slope * by_distance);
        self.threshold_speed.iter().for_each(|(i, slope)| by.rest[*i] += slope * rates.threshold_speed);
    }
}
