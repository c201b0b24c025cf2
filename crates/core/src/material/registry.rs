//! The macro that turns one line per model into everything the rest of the crate needs.

use super::parameters::Parameters;
use super::{Domain, Material};

/// Description of a model, for `pliant list materials` and for the tests.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MaterialDescription {
    /// One line.
    pub summary: &'static str,
    /// The energy density.
    pub formula: &'static str,
    /// Source of the model.
    pub source: &'static str,
    /// Deformations for which the model is defined.
    pub domain: Domain,
    /// True if `psi(Q F) = psi(F)` for every rotation `Q`, as for every real material.
    pub frame_indifferent: bool,
    /// True if `psi(I) = 0` and `P(I) = 0`: without it a body has no rest shape.
    pub has_rest_shape: bool,
}

/// A model that can be registered.
pub trait Model: Clone {
    /// Parameters, the model's table in a scene.
    type Parameters: Parameters;
    /// Description of the model.
    const ABOUT: MaterialDescription;
    /// The model with these parameters, which have been [checked](Parameters::check).
    fn new(parameters: &Self::Parameters) -> Self;
}

/// A computation with a model whose type is known at compile time, see [`MaterialSpec::visit`].
///
/// [`MaterialSpec::visit`]: super::MaterialSpec::visit
pub trait MaterialVisitor<const D: usize> {
    /// Result.
    type Output;
    /// Called once, with the model.
    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output;
}

/// `"name" => file::Type(Parameters);` for each model.
macro_rules! register_materials {
    ($($name:literal => $module:ident :: $model:ident ($parameters:ident);)+) => {
        $(mod $module; pub use $module::$model;)+

        /// A model by name, with its parameters.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[non_exhaustive]
        pub enum MaterialSpec {
            $(
                #[doc = concat!("See [`", stringify!($model), "`].")]
                #[serde(rename = $name)]
                #[schemars(description = <$model as Model>::ABOUT.summary)]
                $model($parameters),
            )+
        }

        impl MaterialSpec {
            /// The name in a scene.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$model(_) => $name,)+ }
            }

            /// Description of the model.
            pub fn about(&self) -> MaterialDescription {
                match self { $(Self::$model(_) => <$model as Model>::ABOUT,)+ }
            }

            /// The Lame parameters that the model has for small strains, if it is meant to have any.
            pub fn lame(&self) -> Option<Lame> {
                match self { $(Self::$model(parameters) => Parameters::lame(parameters),)+ }
            }

            /// Checks that the parameters make sense.
            ///
            /// # Errors
            /// [`ParameterError`] for the first that does not.
            pub fn check(&self) -> Result<(), ParameterError> {
                match self { $(Self::$model(parameters) => parameters.check(),)+ }
            }

            /// The preset that some of the parameters are from, if there is one.
            pub fn preset(&self) -> Option<Preset> {
                match self { $(Self::$model(parameters) => parameters.preset(),)+ }
            }

            /// Plane strain or plane stress, where the scene says which.
            pub fn plane(&self) -> Option<Plane> {
                match self { $(Self::$model(parameters) => parameters.plane(),)+ }
            }

            /// True if turning the material before it is deformed changes nothing.
            pub fn is_isotropic(&self) -> bool {
                match self { $(Self::$model(parameters) => Parameters::is_isotropic(parameters),)+ }
            }

            /// True if it has directions that go by axes of the material, see [`Parameters::has_axes`].
            pub fn has_axes(&self) -> bool {
                match self { $(Self::$model(parameters) => Parameters::has_axes(parameters),)+ }
            }

            /// Calls `visitor` with the model itself, so that what it builds is compiled for that model.
            pub fn visit<const D: usize, V: MaterialVisitor<D>>(&self, visitor: V) -> V::Output {
                match self { $(Self::$model(parameters) => visitor.visit($model::new(parameters)),)+ }
            }

            /// Every registered model, with example parameters, in the order of the registry.
            pub fn examples() -> Vec<MaterialSpec> {
                vec![$(Self::$model(Parameters::example()),)+]
            }
        }
    };
}
pub(super) use register_materials;
