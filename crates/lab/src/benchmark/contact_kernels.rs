//! Contact kernels in isolation: two sheets that lie on each other.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::energy::ChangingStencils;
use pliant::material::Psd;
use pliant_contact::barrier::{Barrier, PotentialForm};
use pliant_contact::candidates::{BodyPairs, CandidatePairs};
use pliant_contact::contacts::Contacts;
use pliant_contact::energy::ContactEnergy;
use pliant_contact::model::{ContactLaw, ContactLaws, ContactModel, Duplicates};
use pliant_contact::surface::{ContactSurface, SurfacePrimitives};
use pliant_contact::way::free_part;

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "contact-kernels",
    summary: "gathering, Hessians and collision of ways of two sheets of 100 x 100 cells near each other",
    cases,
};

/// Number of cells along each side of a sheet, and their size [m].
const CELLS: u32 = 100;
const CELL: f64 = 0.01;
/// Activation distance [m].
const REACH: f64 = 0.1 * CELL;
/// Number of contacts of both sheets, and of candidate pairs along the trajectories.
const STENCILS: f64 = 79_800.0;
const PAIRS: f64 = 169_301.0;

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let threads = threads.unwrap_or(1);
    let case = |name: &str, figure: Metric, reach: f64, part: BenchmarkPart| BenchmarkCase {
        size: 2 * 2 * u64::from(CELLS * CELLS),
        items: "triangles",
        case: name.into(),
        figure,
        parts: vec![part],
        reference: goal(reach),
    };
    let per_stencil = Metric::ItemTime { items: STENCILS, unit: "us/stencil" };
    let hessians = |psd: Psd| BenchmarkPart::new("", threads, move || Ok(Hessians::new(psd)));
    vec![
        case(
            "gathering",
            Metric::Time,
            70.0,
            BenchmarkPart::new("", threads, || Ok(Gathering(Sheets::new()))),
        ),
        case("exact Hessians", per_stencil, 1.0, hessians(Psd::Exact)),
        case("projected Hessians", per_stencil, 1.8, hessians(Psd::Projected)),
        case(
            "ways",
            Metric::ItemTime { items: PAIRS, unit: "us/pair" },
            0.1,
            BenchmarkPart::new("", threads, || Ok(Ways::new())),
        ),
    ]
}

/// Two sheets, the upper one shifted by fractions of a cell.
struct Sheets {
    model: ContactModel,
    /// Positions, flat [m].
    x: Vec<f64>,
}

impl Sheets {
    fn new() -> Sheets {
        let row = CELLS + 1;
        let points = |origin: [f64; 3]| {
            let at = move |i: u32, j: u32| {
                [origin[0] + CELL * f64::from(i), origin[1] + CELL * f64::from(j), origin[2]]
            };
            (0..row).flat_map(move |i| (0..row).flat_map(move |j| at(i, j)))
        };
        let x: Vec<f64> = points([0.0; 3]).chain(points([0.37 * CELL, 0.21 * CELL, 0.5 * REACH])).collect();
        let triangles = |first: u32| {
            (0..CELLS).flat_map(move |i| (0..CELLS).map(move |j| (i, j))).flat_map(move |(i, j)| {
                let [a, b, c, d] =
                    [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| first + i * row + j);
                [[a, b, c], [a, c, d]]
            })
        };
        let triangles: Vec<[u32; 3]> = triangles(0).chain(triangles(row * row)).collect();
        let bodies: Vec<u32> = (0..2 * row * row).map(|v| u32::from(v >= row * row)).collect();
        let primitives = SurfacePrimitives { triangles: &triangles, ..SurfacePrimitives::default() };
        let barrier = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: REACH, offset: 0.0 };
        let model = ContactModel {
            surface: ContactSurface::in_space(&primitives, &x, &bodies),
            half_spaces: vec![],
            balls: vec![],
            pairs: BodyPairs::all(2).of_different_bodies(),
            laws: ContactLaws::new(2, |_, _| ContactLaw { barrier, friction: 0.0 }),
            duplicates: Duplicates::Max,
            threshold_speed: 1e-3,
            friction_iterations: 1,
            shortened: vec![],
            names: vec!["low".into(), "high".into()],
            labels: vec![0; bodies.len()],
        };
        Sheets { model, x }
    }

    /// Candidate pairs within the activation distance, at the positions or along the displacements `dx`.
    fn candidates(&self, dx: Option<&[f64]>) -> CandidatePairs {
        CandidatePairs::gather::<3>(&self.model.surface, &self.model.pairs, &self.x, dx, REACH)
    }

    fn contacts(&self) -> Contacts {
        Contacts::find::<3>(&self.model, &self.candidates(None), &self.x, REACH)
    }
}

/// Workload: trees, candidate pairs, closest points, merged stencils.
struct Gathering(Sheets);

impl Workload for Gathering {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            std::hint::black_box(self.0.contacts());
        }
        Ok(start.elapsed())
    }
}

/// Workload: blocks of the Hessian.
struct Hessians {
    energy: ContactEnergy<3>,
    x: Vec<f64>,
    psd: Psd,
    out: Vec<f64>,
}

impl Hessians {
    fn new(psd: Psd) -> Hessians {
        let Sheets { model, x } = Sheets::new();
        let mut energy = ContactEnergy::<3>::new(Arc::new(model));
        energy.find(&x);
        Hessians { energy, x, psd, out: vec![] }
    }

    /// Ranges of the stencils of two, three and four vertices.
    fn lists(&self) -> Vec<Range<usize>> {
        let count = |list: &pliant::energy::Stencils| list.vertices.len() / list.size.max(1);
        self.energy.lists().iter().map(|list| 0..count(list)).collect()
    }
}

impl Workload for Hessians {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let lists = self.lists();
        // Stencils of four vertices are the most numerous.
        let most = lists.iter().map(|list| list.len()).max().unwrap_or(0);
        self.out.resize(most * 10 * 9, 0.0);
        let start = Instant::now();
        for _ in 0..repetitions {
            for (list, stencils) in lists.iter().enumerate() {
                let v = &self.x;
                self.energy.blocks(list, stencils.clone(), (&self.x, v), self.psd, &mut self.out);
                std::hint::black_box(&mut self.out);
            }
        }
        Ok(start.elapsed())
    }
}

/// Workload: trajectories on which the upper sheet would fall through the lower one.
struct Ways {
    sheets: Sheets,
    dx: Vec<f64>,
    pairs: CandidatePairs,
}

impl Ways {
    fn new() -> Ways {
        let sheets = Sheets::new();
        let half = sheets.x.len() / 2;
        let mut dx = vec![0.0; sheets.x.len()];
        dx[half..].iter_mut().skip(2).step_by(3).for_each(|z| *z = -REACH);
        let pairs = sheets.candidates(Some(&dx));
        Ways { sheets, dx, pairs }
    }
}

impl Workload for Ways {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            let way = (&self.sheets.x[..], &self.dx[..]);
            std::hint::black_box(free_part::<3>(&self.sheets.model, &self.pairs, way));
        }
        Ok(start.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The counts by which times are divided.
    #[test]
    fn stencils_and_pairs_of_the_sheets_are_as_many_as_are_counted() {
        let contacts = Hessians::new(Psd::Exact).lists().iter().map(|list| list.len()).sum::<usize>();
        let ways = Ways::new();
        assert_eq!((contacts as f64, ways.pairs.count() as f64), (STENCILS, PAIRS));
        let part = free_part::<3>(&ways.sheets.model, &ways.pairs, (&ways.sheets.x, &ways.dx));
        // The gap, at first half the activation distance, falls to between a tenth and a twentieth of that.
        assert!((0.45..=0.475).contains(&part), "{part}");
    }
}
