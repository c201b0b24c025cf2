//! The macro that turns one line per model into everything the rest of the crate needs.

use super::parameters::Parameters;
use super::{Domain, Material};

/// Description of a model, for `pliant list materials` and for the tests.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MaterialDescription {
    /// One-line description.
    pub summary: &'static str,
    /// The energy density.
    pub formula: &'static str,
    /// Source of the model.
    pub source: &'static str,
    /// Deformations for which the model is defined.
    pub domain: Domain,
    /// True if `psi(Q F) = psi(F)` for every rotation `Q`, as for every real material.
    pub frame_indifferent: bool,
    /// True if `psi(I) = 0` and `P(I) = 0`, so that the reference configuration is free of stress.
    pub has_rest_shape: bool,
}

/// A model that can be registered.
pub trait Model: Clone {
    /// Parameters, the model's table in a scene.
    type Parameters: Parameters;
    /// Description of the model.
    const ABOUT: MaterialDescription;
    /// Creates the model from [checked](Parameters::check) parameters.
    fn new(parameters: &Self::Parameters) -> Self;
}

/// A computation with a model whose type is known at compile time, see [`MaterialSpec::visit`].
///
/// [`MaterialSpec::visit`]: super::MaterialSpec::visit
pub trait MaterialVisitor<const D: usize> {
    /// Result.
    type Output;
    /// Runs the computation with the model; called once.
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
            /// Returns the name in a scene.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$model(_) => $name,)+ }
            }

            /// Returns the description of the model.
            pub fn about(&self) -> MaterialDescription {
                match self { $(Self::$model(_) => <$model as Model>::ABOUT,)+ }
            }

            /// Returns the Lame parameters for small strains, if the model has them.
            pub fn lame(&self) -> Option<Lame> {
                match self { $(Self::$model(parameters) => Parameters::lame(parameters),)+ }
            }

            /// Checks the ranges of the parameters.
            ///
            /// # Errors
            /// [`ParameterError`] for the first invalid value.
            pub fn check(&self) -> Result<(), ParameterError> {
                match self { $(Self::$model(parameters) => parameters.check(),)+ }
            }

            /// Returns the preset of some of the parameters, if there is one.
            pub fn preset(&self) -> Option<Preset> {
                match self { $(Self::$model(parameters) => parameters.preset(),)+ }
            }

            /// Returns plane strain or plane stress, if the scene specifies it.
            pub fn plane(&self) -> Option<Plane> {
                match self { $(Self::$model(parameters) => parameters.plane(),)+ }
            }

            /// True if a rotation of the material before the deformation changes nothing.
            pub fn is_isotropic(&self) -> bool {
                match self { $(Self::$model(parameters) => Parameters::is_isotropic(parameters),)+ }
            }

            /// True if the material has directions relative to material axes, see
            /// [`Parameters::has_axes`].
            pub fn has_axes(&self) -> bool {
                match self { $(Self::$model(parameters) => Parameters::has_axes(parameters),)+ }
            }

            /// Calls `visitor` with the concrete model, so that its code is compiled for that model.
            pub fn visit<const D: usize, V: MaterialVisitor<D>>(&self, visitor: V) -> V::Output {
                match self { $(Self::$model(parameters) => visitor.visit($model::new(parameters)),)+ }
            }

            /// Returns every registered model with example parameters, in the order of the registry.
            pub fn examples() -> Vec<MaterialSpec> {
                vec![$(Self::$model(Parameters::example()),)+]
            }
        }
    };
}
pub(super) use register_materials;
