//! Strain measures that a formula of an energy density can use, and the programs compiled from it.
//!
//! # How to add one
//! 1. Append the name to `NAMES`, and a constant for its place, like `GREEN`. What the formula `has` decides
//!    how it is compiled: by invariants, by stretches or by components.
//! 2. A component of a tensor gets its value and its derivatives by `F` in `kinematics`, as nodes of a
//!    `Graph`; invariants are set in `of_invariants` and `of_stretches`, stretches in the latter alone.
//! 3. A new kind of node needs a derivative (`slope` in `expression/graph.rs`) and an instruction
//!    (`expression/program.rs`).
//! 4. Compare it with a model written by hand in `tests.rs` beside this file, and name it in
//!    `docs/guide/how-to/expression.md` and in the documentation of `EnergyExpression`.

use std::collections::HashMap;

use super::EnergyMistake;
use crate::expression::{ExpressionError, Formula, Graph, NodeId, Program};
use crate::material::{Domain, ParameterError};

/// Names of the measures of deformation, in the order of the variables of a formula.
pub(super) const NAMES: [&str; 36] = [
    "I1", "I2", "I3", "J", "l1", "l2", "l3", "I4", "I6", // by themselves
    "F11", "F12", "F13", "F21", "F22", "F23", "F31", "F32", "F33", // rows
    "C11", "C12", "C13", "C21", "C22", "C23", "C31", "C32", "C33", //
    "E11", "E12", "E13", "E21", "E22", "E23", "E31", "E32", "E33",
];
const STRETCHES: std::ops::Range<usize> = 4..7;
const FIBRES: std::ops::Range<usize> = 7..9;
const GRADIENT: usize = 9;
const CAUCHY_GREEN: usize = 18;
const GREEN: usize = 27;

/// The formula and its derivatives.
#[derive(Clone, Debug)]
pub(super) struct Programs {
    pub(super) energy: Program,
    pub(super) slopes: Program,
    /// Second derivatives. For invariants: `psi_I1`, `psi_I2`, `psi_J`, then the second derivatives `I1 J`,
    /// `I2 J`, `J J`, `I1 I1`, `I1 I2`, `I2 I2`. For stretches: the matrix of second derivatives. For
    /// components: nothing.
    pub(super) curvatures: Program,
}

/// Kind of measures in the formula; of two forms, that of two dimensions is first.
#[derive(Clone, Debug)]
pub(super) enum Measures {
    Invariants(Programs),
    Stretches([Programs; 2]),
    Components([Programs; 2]),
}

/// A compiled formula.
#[derive(Clone, Debug)]
pub(super) struct Compiled {
    pub(super) measures: Measures,
    /// True if the second invariant is in it.
    pub(super) has_second: bool,
    /// True if the formula is not linear in the first two invariants.
    pub(super) bends: bool,
    /// True if a component of `F` itself is in it.
    pub(super) has_gradient: bool,
    pub(super) domain: Domain,
}

/// A formula with its parameters.
pub(super) struct FormulaSource<'s> {
    pub(super) psi: &'s str,
    pub(super) names: &'s [&'s str],
    pub(super) values: &'s [f64],
    /// Unit vectors.
    pub(super) fibres: &'s [[f64; 3]],
    /// Index of the parameter for a derivative, if it is one.
    pub(super) by: Option<usize>,
}

/// A graph under construction.
struct Builder<'s> {
    graph: Graph,
    source: &'s FormulaSource<'s>,
    formula: &'s Formula,
    dimension: usize,
    /// Definitions of variables that are not inputs.
    definitions: HashMap<u16, NodeId>,
}

impl Compiled {
    /// Reads and compiles a formula; the domain is not yet known.
    pub(super) fn new(source: &FormulaSource<'_>) -> Result<Compiled, EnergyMistake> {
        let names: Vec<&str> = NAMES.iter().chain(source.names).copied().collect();
        let formula = Formula::parse(source.psi, &names)?;
        for (index, name) in source.names.iter().enumerate() {
            if !formula.has(NAMES.len() + index) {
                let problem = format!("`{name}` is not in `psi`: remove it, or use it there");
                return Err(ParameterError::new("parameters", source.values[index], problem).into());
            }
        }
        let has = |mut range: std::ops::Range<usize>| range.find(|name| formula.has(*name));
        let missing =
            FIBRES.enumerate().find(|(fibre, name)| formula.has(*name) && source.fibres.len() <= *fibre);
        if let Some((fibre, name)) = missing {
            let problem = format!(
                "is the number of directions, and `psi` has {}: it is |F a|^2 of direction {} of `fibres`",
                NAMES[name],
                fibre + 1
            );
            return Err(ParameterError::new("fibres", source.fibres.len() as f64, problem).into());
        }
        let stretch = has(STRETCHES);
        let component = has(FIBRES.start..NAMES.len());
        if let (Some(stretch), Some(component)) = (stretch, component) {
            let (stretch, component) = (NAMES[stretch], NAMES[component]);
            return Err(EnergyMistake::Mixed { stretch, component });
        }
        let builder = |dimension| Builder {
            graph: Graph::default(),
            source,
            formula: &formula,
            dimension,
            definitions: HashMap::new(),
        };
        let mut bends = false;
        let measures = if component.is_some() {
            Measures::Components([builder(2).of_components()?, builder(3).of_components()?])
        } else if stretch.is_some() {
            Measures::Stretches([builder(2).of_stretches()?, builder(3).of_stretches()?])
        } else {
            let (programs, is_bent) = builder(3).of_invariants()?;
            bends = is_bent;
            Measures::Invariants(programs)
        };
        let has_gradient = has(GRADIENT..CAUCHY_GREEN).is_some();
        Ok(Compiled { measures, has_second: formula.has(1), bends, has_gradient, domain: Domain::Everywhere })
    }
}

impl Builder<'_> {
    /// The formula, or its derivative with respect to one of its parameters, given the measures.
    fn energy(&mut self, mut measures: Vec<NodeId>) -> Result<NodeId, EnergyMistake> {
        for (index, value) in self.source.values.iter().enumerate() {
            let mut number = self.graph.number(*value);
            if self.source.by == Some(index) {
                self.definitions.insert(PARAMETER, number);
                number = self.graph.variable(PARAMETER);
            }
            measures.push(number);
        }
        let psi = self.formula.add_to(&mut self.graph, &measures)?;
        Ok(match self.source.by {
            Some(_) => self.graph.derivative(psi, PARAMETER),
            None => psi,
        })
    }

    /// All measures, zero until they are set.
    fn nothing(&mut self) -> Vec<NodeId> {
        let zero = self.graph.number(0.0);
        vec![zero; NAMES.len()]
    }

    fn program(&self, roots: &[NodeId], inputs: usize) -> Result<Program, EnergyMistake> {
        Program::new(&self.graph, roots, &self.definitions, inputs).map_err(|[found, most]| {
            EnergyMistake::Formula(ExpressionError::TooLong { found, most, place: 0..self.source.psi.len() })
        })
    }

    /// Compiles a formula of `I1`, `I2` and `J`; true if it is not linear in the first two.
    fn of_invariants(mut self) -> Result<(Programs, bool), EnergyMistake> {
        let mut measures = self.nothing();
        let [i1, i2, j] = [0, 1, 2].map(|variable| self.graph.variable(variable));
        let i3 = self.graph.power(j, 2.0);
        measures[..4].copy_from_slice(&[i1, i2, i3, j]);
        let psi = self.energy(measures)?;
        let slopes = [0, 1, 2].map(|variable| self.graph.derivative(psi, variable));
        let pairs = [(0, 2), (1, 2), (2, 2), (0, 0), (0, 1), (1, 1)];
        let second = pairs.map(|(slope, variable)| self.graph.derivative(slopes[slope], variable));
        let bends = second[3..].iter().any(|node| self.graph.constant(*node) != Some(0.0));
        let all: Vec<NodeId> = slopes.into_iter().chain(second).collect();
        let programs = Programs {
            energy: self.program(&[psi], 3)?,
            slopes: self.program(&slopes, 3)?,
            curvatures: self.program(&all, 3)?,
        };
        Ok((programs, bends))
    }

    /// Compiles a formula of the principal stretches; invariants are expressed by them.
    fn of_stretches(mut self) -> Result<Programs, EnergyMistake> {
        let mut measures = self.nothing();
        let graph = &mut self.graph;
        let l1 = graph.variable(0);
        let l2 = graph.variable(1);
        let l3 = if self.dimension == 2 { graph.number(1.0) } else { graph.variable(2) };
        let squares = [l1, l2, l3].map(|l| graph.power(l, 2.0));
        let [a, b, c] = squares;
        let i1 = graph.sum(a, b);
        let i1 = graph.sum(i1, c);
        let i2 = [(a, b), (b, c), (c, a)].map(|(a, b)| graph.product(a, b));
        let i2 = i2.into_iter().reduce(|sum, product| graph.sum(sum, product)).expect("three");
        let j = graph.product(l1, l2);
        let j = graph.product(j, l3);
        let i3 = graph.power(j, 2.0);
        measures[..7].copy_from_slice(&[i1, i2, i3, j, l1, l2, l3]);
        let psi = self.energy(measures)?;
        let variables = 0..self.dimension as u16;
        let slopes: Vec<NodeId> =
            variables.clone().map(|variable| self.graph.derivative(psi, variable)).collect();
        let mut second = Vec::new();
        for slope in &slopes {
            for variable in variables.clone() {
                second.push(self.graph.derivative(*slope, variable));
            }
        }
        Ok(Programs {
            energy: self.program(&[psi], self.dimension)?,
            slopes: self.program(&slopes, self.dimension)?,
            curvatures: self.program(&second, self.dimension)?,
        })
    }

    /// Compiles a formula of the components of `F`, by the chain rule over the measures in the formula.
    fn of_components(mut self) -> Result<Programs, EnergyMistake> {
        let dimension = self.dimension;
        let inputs = dimension * dimension;
        let (measures, gradients) = self.kinematics();
        let psi = self.energy(measures)?;
        let graph = &mut self.graph;
        let mut stress = vec![graph.number(0.0); inputs];
        for variable in graph.variables(psi).into_iter().filter(|variable| *variable != PARAMETER) {
            let slope = graph.derivative(psi, variable);
            match gradients.get(&variable) {
                None => stress[usize::from(variable)] = graph.sum(stress[usize::from(variable)], slope),
                Some(gradient) => {
                    for (stress, gradient) in stress.iter_mut().zip(gradient) {
                        let product = graph.product(slope, *gradient);
                        *stress = graph.sum(*stress, product);
                    }
                }
            }
        }
        Ok(Programs {
            energy: self.program(&[psi], inputs)?,
            slopes: self.program(&stress, inputs)?,
            curvatures: self.program(&[], inputs)?,
        })
    }

    /// The measures as variables of their own, and their derivatives with respect to `F`, row by row.
    fn kinematics(&mut self) -> (Vec<NodeId>, HashMap<u16, Vec<NodeId>>) {
        let dimension = self.dimension;
        let mut all = self.nothing();
        let graph = &mut self.graph;
        let (zero, one) = (graph.number(0.0), graph.number(1.0));
        let mut f = [[zero; 3]; 3];
        f[2][2] = one;
        for i in 0..dimension {
            for j in 0..dimension {
                f[i][j] = graph.variable((i * dimension + j) as u16);
            }
        }
        let definitions = &mut self.definitions;
        let mut gradients = HashMap::new();
        // Variables beyond those of F are the measures, by their place in the list.
        let variable_of = |name: usize| (FIRST_MEASURE + name) as u16;
        let in_plane = |matrix: &[[NodeId; 3]; 3]| -> Vec<NodeId> {
            matrix[..dimension].iter().flat_map(|row| row[..dimension].to_vec()).collect()
        };
        let dot = |graph: &mut Graph, a: [NodeId; 3], b: [NodeId; 3]| {
            let products = [0, 1, 2].map(|k| graph.product(a[k], b[k]));
            products.into_iter().reduce(|sum, product| graph.sum(sum, product)).expect("three")
        };
        let column = |f: &[[NodeId; 3]; 3], j: usize| [f[0][j], f[1][j], f[2][j]];
        // C, and E by way of it.
        let mut c = [[zero; 3]; 3];
        for i in 0..3 {
            for j in i..3 {
                let definition = dot(graph, column(&f, i), column(&f, j));
                let variable = variable_of(CAUCHY_GREEN + 3 * i + j);
                c[i][j] = match graph.constant(definition) {
                    Some(_) => definition,
                    None => {
                        definitions.insert(variable, definition);
                        let mut gradient = [[zero; 3]; 3];
                        for k in 0..3 {
                            gradient[k][i] = graph.sum(gradient[k][i], f[k][j]);
                            gradient[k][j] = graph.sum(gradient[k][j], f[k][i]);
                        }
                        gradients.insert(variable, in_plane(&gradient));
                        graph.variable(variable)
                    }
                };
                c[j][i] = c[i][j];
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                let place = 3 * i + j;
                all[GRADIENT + place] = f[i][j];
                all[CAUCHY_GREEN + place] = c[i][j];
                let strain = if i == j { graph.difference(c[i][j], one) } else { c[i][j] };
                let half = graph.number(0.5);
                all[GREEN + place] = graph.product(half, strain);
            }
        }
        // The invariants.
        let mut measure = |graph: &mut Graph, name: usize, definition: NodeId, gradient: [[NodeId; 3]; 3]| {
            let variable = variable_of(name);
            definitions.insert(variable, definition);
            gradients.insert(variable, in_plane(&gradient));
            all[name] = graph.variable(variable);
            all[name]
        };
        let two = graph.number(2.0);
        let trace = graph.sum(c[0][0], c[1][1]);
        let trace = graph.sum(trace, c[2][2]);
        let double = f.map(|row| row.map(|entry| graph.product(two, entry)));
        let i1 = measure(graph, 0, trace, double);
        let mut second = zero;
        let mut bent = [[zero; 3]; 3];
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let product = graph.product(c[i][i], c[j][j]);
            let square = graph.power(c[i][j], 2.0);
            let minor = graph.difference(product, square);
            second = graph.sum(second, minor);
        }
        for i in 0..3 {
            for j in 0..3 {
                let stretched = graph.product(i1, f[i][j]);
                let turned = dot(graph, f[i], c[j]);
                let difference = graph.difference(stretched, turned);
                bent[i][j] = graph.product(two, difference);
            }
        }
        measure(graph, 1, second, bent);
        let mut cofactor = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let ([a, b], [c, d]) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
                let (down, up) = (graph.product(f[a][c], f[b][d]), graph.product(f[a][d], f[b][c]));
                cofactor[i][j] = graph.difference(down, up);
            }
        }
        let determinant = dot(graph, f[0], cofactor[0]);
        let j = measure(graph, 3, determinant, cofactor);
        for (fibre, name) in self.source.fibres.iter().zip(FIBRES) {
            let direction = fibre.map(|component| graph.number(component));
            let image = f.map(|row| dot(graph, row, direction));
            let square = dot(graph, image, image);
            let gradient = image.map(|image| {
                direction.map(|direction| {
                    let product = graph.product(image, direction);
                    graph.product(two, product)
                })
            });
            measure(graph, name, square, gradient);
        }
        all[2] = graph.power(j, 2.0);
        (all, gradients)
    }
}

/// The variable that a derivative by a number is taken by.
const PARAMETER: u16 = 99;

/// The variable of the first measure.
const FIRST_MEASURE: usize = 100;
