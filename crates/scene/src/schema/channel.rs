//! Channels of a recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::diagnostics::{Measure, RecordedField};

/// Defines [`Channel`] from one entry per channel: documentation, name and, unless it is about a measure of
/// elements or a recovered stress, what the report of a scene says with it and without it.
macro_rules! channels {
    ($($(#[$documentation:meta])* $variant:ident: $name:literal $(, $with:literal, $without:literal)?;)+) => {
        /// One kind of output.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        pub enum Channel {
            $($(#[$documentation])* #[serde(rename = $name)] $variant,)+
        }

        impl Channel {
            /// All channels.
            pub const ALL: &[Channel] = &[$(Channel::$variant,)+];

            /// The name of the choice, as in the scene.
            pub fn name(self) -> &'static str {
                match self {
                    $(Channel::$variant => $name,)+
                }
            }

            /// Sentences about a run with and without the channel; `None` for a measure of elements, or of
            /// the recovered stress.
            pub(crate) fn sentences(self) -> Option<[&'static str; 2]> {
                match self {
                    $(Channel::$variant => None$(.or(Some([$with, $without])))?,)+
                }
            }
        }
    };
}

channels! {
    /// Positions and velocities of every vertex, on `/state`.
    State: "state",
        "output /state",
        "output /state: not written";
    /// Triangles and lines for a viewer, on `/mesh`.
    Mesh: "mesh",
        "output /mesh",
        "output /mesh: not written";
    /// Energies, what came in and what was lost, and momenta, on `/energy`.
    Energy: "energy",
        "output /energy: energies, their balance with all losses, and momenta at every frame",
        "output /energy: energies are computed every 128 steps and in frames, to detect \
          instability; there is no energy balance";
    /// Force [N] and moment [N m] with which every pin holds its vertices and every wall pushes, on
    /// `/reactions`.
    Reactions: "reactions",
        "output /reactions: force and moment of every pin and wall",
        "output /reactions: forces of pins and walls are computed once, at the end";
    /// Surfaces that touch, on `/contacts`: bodies, closest points [m], normal, gap [m], normal force and
    /// friction [N] of every pair of primitives.
    Contacts: "contacts",
        "output /contacts: every pair that touches, with its gap and forces",
        "output /contacts: pairs that touch are not listed";
    /// Deformation gradient `F` of every finite element, on `/elements/deformation-gradient`: nine numbers,
    /// row by row. In 2D the third axis is out of the plane, here and in the channels below; elements of
    /// second order are looked at in their centroid.
    DeformationGradient: "deformation-gradient";
    /// `J = det F` of every finite element, on `/elements/jacobian`.
    Jacobian: "jacobian";
    /// Principal stretches of every finite element, on `/elements/principal-stretches`, descending in
    /// magnitude; the last is negative where the element is inverted.
    PrincipalStretches: "principal-stretches";
    /// Green strain `E = 1/2 (F^T F - I)` of every finite element, on `/elements/green-strain`: xx, yy, zz,
    /// xy, yz, xz.
    GreenStrain: "green-strain";
    /// Corotated strain `S - I` of every finite element, `F = R S` the signed polar decomposition, on
    /// `/elements/corotated-strain`: xx, yy, zz, xy, yz, xz.
    CorotatedStrain: "corotated-strain";
    /// First Piola-Kirchhoff stress `P = dpsi/dF` [Pa] of every finite element, on `/elements/first-piola`:
    /// nine numbers, row by row.
    FirstPiola: "first-piola";
    /// Cauchy stress `P F^T / J` [Pa] of every finite element, on `/elements/cauchy-stress`: xx, yy, zz, xy,
    /// yz, xz.
    CauchyStress: "cauchy-stress";
    /// Von Mises stress [Pa] of every finite element, on `/elements/von-mises`.
    VonMises: "von-mises";
    /// Strain energy density `psi(F)` by the volume at rest [J/m^3] of every finite element, on
    /// `/elements/energy-density`.
    EnergyDensity: "energy-density";
    /// Von Mises stress [Pa] at every vertex, of the recovered stress, on `/vertices/nodal-von-mises`. NaN
    /// at vertices of no finite element.
    NodalVonMises: "nodal-von-mises";
    /// Cauchy stress [Pa] at every vertex, on `/vertices/nodal-stress`: xx, yy, zz, xy, yz, xz. `recovery`
    /// says how it follows from the stress of the elements, never across bodies. NaN at vertices of no
    /// finite element.
    NodalStress: "nodal-stress";
    /// Estimated error of the stress of every finite element in the energy norm [sqrt(J)], on
    /// `/elements/zz`: the distance from the recovered stress (Zienkiewicz, Zhu 1992). The square root of
    /// the sum of squares is the error of the whole. Not for membranes.
    Zz: "zz";
    /// Normal force of contact per present area of the surface [Pa] at every vertex, on
    /// `/vertices/contact-pressure`. Forces on both sides of a sheet add up. NaN at vertices of no surface.
    ContactPressure: "contact-pressure",
        "output /vertices/contact-pressure: normal forces of contact per area",
        "output /vertices/contact-pressure: not computed";
    /// Friction of contact per present area of the surface [Pa] at every vertex, on
    /// `/vertices/contact-shear`: x, y, z. NaN at vertices of no surface.
    ContactShear: "contact-shear",
        "output /vertices/contact-shear: friction of contact per area",
        "output /vertices/contact-shear: not computed";
}

impl Channel {
    /// The measure of elements that it records; `None` for a channel that is not about elements.
    pub fn measure(self) -> Option<&'static Measure> {
        Measure::named(self.name())
    }

    /// The field of elements or vertices that it records; `None` for another channel.
    pub fn field(self) -> Option<RecordedField> {
        RecordedField::named(self.name())
    }

    /// True if the channel is about the recovered stress.
    pub fn is_recovered(self) -> bool {
        self.field().is_some() && self.measure().is_none() && !self.is_of_contact()
    }

    /// True if the channel is about surfaces in contact.
    pub fn is_of_contact(self) -> bool {
        matches!(self, Channel::Contacts | Channel::ContactPressure | Channel::ContactShear)
    }
}
