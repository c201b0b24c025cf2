//! A body: its name, its supports, its mass.

use super::check::Checker;
use super::{bending, damping, expression, loads, membrane, mesh, motion, muscles, pins, transform};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, MassSpec, MeshSpec, OneOrMany, SpringsSpec};
use pliant::material::MaterialSpec;

/// Length limit of names, which become topics and file names in a recording.
const LONGEST_NAME: usize = 64;

pub(super) fn name(check: &mut Checker, path: &KeyPath, body: &Body) {
    if let Some(name) = &body.name {
        identifier(check, &path.key("name"), name, "a body");
    }
}

/// Checks that the name of `what` is valid in topics, file names and messages.
pub(super) fn identifier(check: &mut Checker, path: &KeyPath, name: &str, what: &str) {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(allowed) {
        let problem = Problem::semantic(path.clone(), format!("{name:?} cannot be the name of {what}"));
        check.report(problem.with_help(format!(
            "use letters a to z, digits, `_` and `-`: at least 1, at most {LONGEST_NAME} characters"
        )));
    }
}

pub(super) fn body(check: &mut Checker, path: &KeyPath, body: &Body, attracted: bool, duration: f64) {
    let dimension = check.dimension;
    mesh::mesh(check, &path.key("mesh"), &body.mesh);
    transform::transform(check, path, body);
    let has = MeshCapabilities::of(&body.mesh, dimension).times(body.copies());
    let made_of = BodyContents {
        elastic: body.elastic.is_some(),
        membrane: body.membrane.is_some(),
        springs: body.springs.is_some(),
    };
    for problem in made_of.problems(path, &body.mesh, has, dimension, attracted) {
        check.report(problem);
    }
    if let Some(material) = &body.elastic {
        let path = path.key("elastic").key(material.name());
        if let MaterialSpec::ExpressedEnergy(energy) = material {
            expression::expression(check, &path, energy, body);
        } else if let Err(error) = material.check() {
            check.report(expression::parameter(&path, &error));
        } else {
            expression::directions(check, &path, material, body);
        }
    }
    if let Some(material) = &body.elastic
        && material.plane().is_some()
        && dimension == Some(3)
    {
        let path = path.key("elastic").key(material.name()).key("plane");
        let problem =
            Problem::semantic(path, "`plane` is for scenes of two dimensions, and `dimension` is 3");
        check.report(problem.with_help("remove `plane`"));
    }
    if let Some(membrane) = &body.membrane {
        membrane::membrane(check, path, membrane, body);
    }
    order(check, &path.key("order"), body);
    if let Some(refine) = body.refine {
        check.count(&path.key("refine"), refine);
    }
    if let Some(factor) = &body.elastic_factor {
        elastic_factor(check, &path.key("elastic_factor"), factor, body);
    }
    if let Some(axes) = &body.elastic_axes {
        muscles::axes(check, &path.key("elastic_axes"), axes, body, duration);
    }
    muscles::muscles(check, &path.key("muscle"), body, duration);
    if body.stress.is_some() && body.elastic.is_none() {
        let problem =
            Problem::semantic(path.key("stress"), "`stress` needs `elastic`, which this body does not have");
        check.report(problem.with_help("remove `stress`, or add `elastic`"));
    }
    if let Some(springs) = &body.springs {
        self::springs(check, &path.key("springs"), springs, has.edge_count);
    }
    if let Some(bending) = &body.bending {
        bending::bending(check, &path.key("bending"), bending, body);
    }
    if let Some(damping) = &body.damping {
        damping::damping(check, &path.key("damping"), damping, body);
    }
    mass(check, &path.key("mass"), body, has);
    pins::pins(check, &path.key("pin"), body, duration);
    loads::loads(check, &path.key("load"), body, duration);
    if let Some(position) = &body.position {
        motion::position(check, &path.key("position"), position, body.vertex_count());
    }
    if let Some(velocity) = &body.velocity {
        motion::velocity(check, &path.key("velocity"), velocity, body.vertex_count());
    }
}

/// Checks that the order is 1 or 2, and 2 for finite elements only.
fn order(check: &mut Checker, path: &KeyPath, body: &Body) {
    if body.serendipity && !body.is_quadratic() {
        let message = "`serendipity` is a choice of elements of second order, and this body has none";
        let problem = Problem::semantic(path.clone(), message);
        check.report(problem.with_help("add `order = 2`, or remove `serendipity`"));
    }
    let Some(order) = body.order else { return };
    if !(1..=2).contains(&order) {
        let message = format!("`order` must be 1 or 2, got {order}");
        check.report(Problem::semantic(path.clone(), message));
    } else if body.elastic.is_none() {
        let problem = Problem::semantic(
            path.clone(),
            "`order` is that of finite elements: it needs `elastic`, which this body does not have",
        );
        check.report(problem.with_help("remove `order`, or add `elastic`"));
    } else if order == 2 && body.springs.is_some() {
        let problem = Problem::semantic(
            path.clone(),
            "`springs` connect corners and do not support mid-edge nodes: a body of `order` 2 cannot have \
             them",
        );
        check.report(problem.with_help("remove `springs`, or use `order = 1`"));
    }
}

/// Features of a mesh that forces can be based on. A file counts as having all of them until it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshCapabilities {
    /// Triangles in 2D, tetrahedra in 3D: elements for a material.
    pub(super) elements: bool,
    /// Triangles in 3D that are not sides of tetrahedra: elements for a membrane.
    pub(super) sheet: bool,
    /// Edges or cells of any kind: edges for springs.
    pub(super) edges: bool,
    /// Number of edges, if it is known.
    pub(super) edge_count: Option<u64>,
}

impl MeshCapabilities {
    pub(super) fn of(mesh: &MeshSpec, dimension: Option<usize>) -> MeshCapabilities {
        let flat = dimension != Some(3);
        let sheet = match mesh {
            MeshSpec::Cloth(_) | MeshSpec::Sphere(_) | MeshSpec::File(_) => !flat,
            MeshSpec::Inline(inline) => {
                let solids = !inline.tetrahedra.is_empty() || !inline.hexahedra.is_empty();
                !flat && !inline.triangles.is_empty() && !solids
            }
            _ => false,
        };
        let (elements, edges, edge_count) = match mesh {
            MeshSpec::Grid(_) | MeshSpec::File(_) => (true, true, None),
            MeshSpec::Sphere(_) => (false, true, None),
            MeshSpec::Ball(_) | MeshSpec::Cylinder(_) | MeshSpec::Tube(_) | MeshSpec::Surface(_) => {
                (true, true, None)
            }
            MeshSpec::Annulus(_)
            | MeshSpec::CooksMembrane(_)
            | MeshSpec::TaperedBeam(_)
            | MeshSpec::NotchedBeam(_)
            | MeshSpec::EllipticMembrane(_) => (true, true, None),
            MeshSpec::Cloth(cloth) => {
                let [n0, n1] = cloth.cells.map(|n| n as u64);
                // Edges along both sides and both diagonals of every cell; an overflow of u64 is rejected
                // elsewhere.
                let cells = n0.checked_mul(n1);
                let edges = cells.and_then(|cells| cells.checked_mul(4)?.checked_add(n0)?.checked_add(n1));
                (flat, true, edges)
            }
            MeshSpec::Strand(strand) => (false, true, Some(strand.segments as u64)),
            MeshSpec::Disk(_) => (false, false, Some(0)),
            MeshSpec::Inline(inline) => {
                let [simplices, others] = if flat {
                    [inline.triangles.is_empty(), inline.quadrilaterals.is_empty()]
                } else {
                    [inline.tetrahedra.is_empty(), inline.hexahedra.is_empty()]
                };
                let none = simplices && others;
                let cells = !none || !inline.triangles.is_empty() || !inline.tetrahedra.is_empty();
                let explicit = inline.edges.len() as u64;
                // Without explicit edges, springs run along the edges of the cells, which are not counted
                // here.
                (!none, explicit > 0 || cells, (explicit > 0).then_some(explicit))
            }
        };
        MeshCapabilities { elements, sheet, edges, edge_count }
    }

    /// Features of this many copies.
    fn times(self, copies: u64) -> MeshCapabilities {
        MeshCapabilities { edge_count: self.edge_count.and_then(|count| count.checked_mul(copies)), ..self }
    }
}

/// Energies of a body, separate from it, so that tests need no material.
pub(super) struct BodyContents {
    pub(super) elastic: bool,
    pub(super) membrane: bool,
    pub(super) springs: bool,
}

impl BodyContents {
    pub(super) fn problems(
        &self,
        path: &KeyPath,
        mesh: &MeshSpec,
        has: MeshCapabilities,
        dimension: Option<usize>,
        attracted: bool,
    ) -> Vec<Problem> {
        let mut problems = Vec::new();
        let shape = mesh.name();
        if self.elastic && !has.elements && !self.membrane {
            let message =
                format!("`elastic` fills triangles (2D) or tetrahedra (3D), and this {shape} has none");
            let mut problem = Problem::semantic(path.key("elastic"), message).at_key();
            if has.sheet {
                problem = problem
                    .with_help("for a sheet of finite elements add `membrane = { thickness = \"1 mm\" }`");
            }
            problems.push(if has.edges { problem.with_help("use `springs` instead") } else { problem });
        }
        if self.membrane && self.elastic && dimension == Some(3) && !has.sheet {
            let message =
                format!("`membrane` is made of triangles in 3D, and this {shape} has none of its own");
            let problem = Problem::semantic(path.key("membrane"), message).at_key();
            problems.push(if has.elements {
                problem.with_help("remove `membrane`: it is a solid")
            } else {
                problem
            });
        }
        if self.springs && !has.edges {
            let message = format!("`springs` run along edges, and this {shape} has none");
            problems.push(Problem::semantic(path.key("springs"), message).at_key());
        }
        if !self.elastic && !self.springs && has.edges && !attracted {
            let message = format!("nothing holds this {shape} together");
            let what = if has.elements { "`elastic` or `springs`" } else { "`springs`" };
            let problem = Problem::semantic(path.key("mesh"), message).at_key();
            problems.push(problem.with_help(format!(
                "add {what}; for free particles use a `disk`, or `inline` points without cells"
            )));
        }
        problems
    }
}

fn springs(check: &mut Checker, path: &KeyPath, springs: &SpringsSpec, edge_count: Option<u64>) {
    let edges = edge_count.filter(|&count| count > 0).map(|count| (count, "edges"));
    match (&springs.stiffness, springs.young, &springs.expression) {
        (Some(stiffness), None, None) => {
            check.one_or_many(&path.key("stiffness"), stiffness, "N/m", edges);
        }
        (None, Some(young), None) => {
            check.number(&path.key("young"), young, "N/m^2");
        }
        (None, None, Some(text)) => expression::springs(check, path, springs, text),
        (stiffness, young, formula) => {
            let given = usize::from(stiffness.is_some())
                + usize::from(young.is_some())
                + usize::from(formula.is_some());
            let how = match given {
                0 => "none is given",
                2 => "two are given",
                _ => "all are given",
            };
            let message = format!(
                "`springs` take exactly one of `stiffness` [N/m], `young` [N/m^2] and `expression` [J], {how}"
            );
            check.report(Problem::semantic(path.clone(), message).at_key());
        }
    }
    if springs.expression.is_none() && !springs.parameters.is_empty() {
        let message = "`parameters` are those of `expression`, which these springs do not have";
        check.report(Problem::semantic(path.key("parameters"), message).with_help("remove `parameters`"));
    }
    if let Some(rest_length) = &springs.rest_length {
        check.one_or_many(&path.key("rest_length"), rest_length, "m", edges);
    }
}

fn mass(check: &mut Checker, path: &KeyPath, body: &Body, has: MeshCapabilities) {
    match &body.mass {
        MassSpec::Density(density) => {
            let path = path.key("density");
            check.number(
                &path,
                density.value,
                if body.membrane.is_some() {
                    "kg/m^3"
                } else {
                    unit_of_density(&body.mesh, has, check.dimension)
                },
            );
            something_to_fill(check, path, body, has);
        }
        MassSpec::Preset(_) => something_to_fill(check, path.key("preset"), body, has),
        MassSpec::PerVertex(masses) => {
            let count = body.vertex_count().map(|count| (count, "vertices"));
            check.one_or_many(&path.key("per_vertex"), masses, "kg", count);
        }
        MassSpec::Total(total) => {
            check.number(&path.key("total"), *total, "kg");
        }
    }
}

/// Unit of the density for the cells of the mesh: a file counts as having elements until it is read.
fn unit_of_density(mesh: &MeshSpec, has: MeshCapabilities, dimension: Option<usize>) -> &'static str {
    let sheet = matches!(mesh, MeshSpec::Cloth(_) | MeshSpec::Sphere(_))
        || matches!(mesh, MeshSpec::Inline(inline) if !inline.triangles.is_empty());
    match (has.elements, dimension) {
        (true, Some(2)) => "kg/m^2",
        (true, _) => "kg/m^3",
        (false, _) if sheet => "kg/m^2",
        (false, _) => "kg/m",
    }
}

/// Checks that there are cells or edges for a density.
fn something_to_fill(check: &mut Checker, path: KeyPath, body: &Body, has: MeshCapabilities) {
    if !has.edges {
        let key = path.last_key().unwrap_or("density").to_owned();
        let message = format!("`{key}` fills cells and edges, and this {} has none", body.mesh.name());
        let problem = Problem::semantic(path, message).at_key();
        check.report(problem.with_help("use `per_vertex` or `total` [kg]"));
    }
}

/// Checks `elastic_factor` of `body`; assembly checks the number of factors.
fn elastic_factor(check: &mut Checker, path: &KeyPath, factor: &OneOrMany, body: &Body) {
    check.one_or_many(path, factor, "", None);
    let stiff = body.damping.as_ref().is_some_and(|damping| damping.stiffness_proportional.is_some());
    let refused = [
        (
            body.elastic.is_none(),
            "is one of finite elements, and this body has no `elastic`",
            "add `elastic`",
        ),
        (
            body.membrane.is_some(),
            "is for solids, and this body is a `membrane`",
            "make a body of each stiffness",
        ),
        (
            stiff,
            "does not reach `stiffness_proportional` damping, which has one stiffness for the body",
            "use `strain_rate` damping, whose viscosities do not depend on the stiffness",
        ),
    ];
    for (_, message, help) in refused.into_iter().filter(|(is_refused, ..)| *is_refused) {
        let problem = Problem::semantic(path.clone(), format!("`elastic_factor` {message}")).at_key();
        check.report(problem.with_help(help));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::{ClothSpec, DiskSpec, StrandSpec};

    fn messages(mesh: &MeshSpec, dimension: usize, elastic: bool, springs: bool) -> Vec<String> {
        let has = MeshCapabilities::of(mesh, Some(dimension));
        let made_of = BodyContents { elastic, membrane: false, springs };
        let problems = made_of.problems(&KeyPath::root(), mesh, has, Some(dimension), false);
        problems.into_iter().map(|problem| format!("{}: {}", problem.path, problem.message)).collect()
    }

    fn filled(shape: &str) -> [String; 1] {
        [format!("elastic: `elastic` fills triangles (2D) or tetrahedra (3D), and this {shape} has none")]
    }

    #[test]
    fn elements_need_cells_of_the_dimension() {
        let strand = MeshSpec::Strand(StrandSpec { segments: 1, start: vec![], end: vec![] });
        assert_eq!(messages(&strand, 2, true, false), filled("strand"));
        let disk = MeshSpec::Disk(DiskSpec {
            count: 1,
            radius: 1.0,
            inner_radius: 0.0,
            centre: None,
            thickness: 0.0,
            seed: 0,
        });
        assert_eq!(messages(&disk, 3, true, false), filled("disk"));
        let cloth = MeshSpec::Cloth(ClothSpec { cells: [2, 3], origin: vec![], u: vec![], v: vec![] });
        assert_eq!(messages(&cloth, 3, true, true), filled("cloth"));
        assert!(messages(&cloth, 2, true, false).is_empty());
        assert_eq!(MeshCapabilities::of(&cloth, Some(3)).edge_count, Some(2 * 4 + 3 * 3 + 2 * 6));
    }
}
