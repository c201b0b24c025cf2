//! Measures of mesh quality.

use super::Mesh;
use super::geometry::{SimplexMeasure, measure};
use pliant::element::{self, CellBlock, CellVisitor, Isoparametric};

/// Size and shape of a mesh.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Quality {
    /// Number of vertices.
    pub vertex_count: usize,
    /// Lower corner of the bounding box, `(dimension)` [m].
    pub lower: Vec<f64>,
    /// Upper corner of the bounding box, `(dimension)` [m].
    pub upper: Vec<f64>,
    /// Quality of the elements; `None` for points.
    pub elements: Option<ElementQuality>,
}

/// Sizes and shapes of the elements, the cells of the highest dimension `d`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ElementQuality {
    /// 3 for tetrahedra or hexahedra, 2 for triangles or quadrilaterals, 1 for edges.
    pub topological_dimension: usize,
    /// Number of elements.
    pub count: usize,
    /// Sum of all volumes [m^3], areas [m^2] or lengths [m]; the volumes below have the same unit.
    pub total_volume: f64,
    /// Volume of the smallest element.
    pub smallest_volume: f64,
    /// Index of the smallest element.
    pub smallest: usize,
    /// Volume of the largest element.
    pub largest_volume: f64,
    /// Index of the largest element.
    pub largest: usize,
    /// Smallest mean ratio.
    pub worst_mean_ratio: f64,
    /// Index of the element with the smallest mean ratio.
    pub worst: usize,
    /// Mean of the mean ratios.
    pub average_mean_ratio: f64,
    /// Curvature of second-order elements: see [`CurvedQuality`].
    pub curved: Option<CurvedQuality>,
}

/// Effect of curved sides on elements.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CurvedQuality {
    /// Lower bound of `det J` over the worst element, as a fraction of its mean there: 1 if all sides are
    /// straight, near 0 if the element is nearly folded.
    pub least_jacobian: f64,
    /// Index of the worst element.
    pub worst: usize,
}

/// Mean ratio of a simplex with `n` vertices: 1 if all edges are equal, towards 0 if it is flat.
///
/// Tetrahedra: `12 (3 V)^(2/3) / sum of squared edge lengths`, measure 3 of J. Burkardt's TET_MESH_QUALITY,
/// after Liu and Joe. Triangles: `4 sqrt(3) A / sum of squared edge lengths`, the same ratio in the plane.
/// Edges: 1.
fn mean_ratio(m: &SimplexMeasure, n: usize) -> f64 {
    match n {
        2 => 1.0,
        3 => 2.0 * 3.0_f64.sqrt() * m.relative / m.relative_edges,
        _ => 12.0 * (m.relative / 2.0).powf(2.0 / 3.0) / m.relative_edges,
    }
}

impl Mesh {
    /// Computes bounding box, volumes and mean ratios; `O(n)`. The mesh must have passed the checks of
    /// [`build`](super::build).
    pub fn quality(&self) -> Quality {
        let (lower, upper) = self.bounding_box();
        let mut elements = match self.element_dimension() {
            _ if self.block().is_some() => {
                self.block().and_then(|block| block.kind.visit(QualityVisitor { mesh: self, block }))
            }
            3 => elements(self, &self.tetrahedra),
            2 => elements(self, &self.triangles),
            _ => elements(self, &self.edges),
        };
        if let Some(elements) = &mut elements {
            match (self.order(), self.dimension, elements.topological_dimension) {
                _ if self.block().is_some() => {}
                (2, 3, 3) => self.measure_curved::<3, 10>(elements),
                (2, 2, 2) => self.measure_curved::<2, 6>(elements),
                _ => {}
            }
        }
        Quality { vertex_count: self.vertex_count(), lower, upper, elements }
    }
}

impl Mesh {
    /// Replaces the volumes of the straight simplices by those with curved sides.
    fn measure_curved<const D: usize, const N: usize>(&self, quality: &mut ElementQuality) {
        let (mut smallest, mut largest) = ((f64::INFINITY, 0), (0.0, 0));
        let mut curved = CurvedQuality { least_jacobian: f64::INFINITY, worst: 0 };
        quality.total_volume = 0.0;
        for (i, cell) in self.elements::<N>().iter().enumerate() {
            let nodes = self.nodes::<D, N>(cell);
            let (volume, least) = (element::volume(&nodes), element::least_jacobian(&nodes));
            quality.total_volume += volume;
            if volume < smallest.0 {
                smallest = (volume, i);
            }
            if volume > largest.0 {
                largest = (volume, i);
            }
            if least < curved.least_jacobian {
                curved = CurvedQuality { least_jacobian: least, worst: i };
            }
        }
        (quality.smallest_volume, quality.smallest) = smallest;
        (quality.largest_volume, quality.largest) = largest;
        quality.curved = Some(curved);
    }
}

struct QualityVisitor<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for QualityVisitor<'_> {
    type Output = Option<ElementQuality>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Self::Output {
        let of_cell = |cell: &[u32; N]| {
            let nodes = self.mesh.nodes::<D, N>(cell);
            (kind.volume(&nodes), kind.mean_ratio(&nodes))
        };
        let cells: Vec<(f64, f64)> = self.block.of::<N>().iter().map(of_cell).collect();
        let by = |value: fn(&(f64, f64)) -> f64| {
            let indices = 0..cells.len();
            let less = |a: &usize, b: &usize| value(&cells[*a]).total_cmp(&value(&cells[*b])).then(a.cmp(b));
            // The first of equal elements.
            (indices.clone().min_by(less), indices.rev().max_by(|a, b| less(a, b).then(b.cmp(a))))
        };
        let ((Some(smallest), Some(largest)), (Some(worst), _)) = (by(|cell| cell.0), by(|cell| cell.1))
        else {
            return None;
        };
        Some(ElementQuality {
            topological_dimension: D,
            count: cells.len(),
            total_volume: cells.iter().map(|cell| cell.0).sum(),
            smallest_volume: cells[smallest].0,
            smallest,
            largest_volume: cells[largest].0,
            largest,
            worst_mean_ratio: cells[worst].1,
            worst,
            average_mean_ratio: cells.iter().map(|cell| cell.1 / cells.len() as f64).sum(),
            curved: (kind.kind.order() == 2).then(|| self.curved(kind)).flatten(),
        })
    }
}

impl QualityVisitor<'_> {
    /// Most curved cell, by the least `det J` at its nodes and quadrature points.
    fn curved<const D: usize, const N: usize>(&self, kind: &Isoparametric<D, N>) -> Option<CurvedQuality> {
        let cells =
            self.block.of::<N>().iter().map(|cell| kind.least_jacobian(&self.mesh.nodes::<D, N>(cell)));
        let (worst, least_jacobian) = cells.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        // A straight cell gives 1 up to rounding.
        let least_jacobian = if least_jacobian > 1.0 - 1e-12 { 1.0 } else { least_jacobian };
        Some(CurvedQuality { least_jacobian, worst })
    }
}

fn elements<const N: usize>(mesh: &Mesh, cells: &[[u32; N]]) -> Option<ElementQuality> {
    let first = measure(&mesh.points, mesh.dimension, *cells.first()?);
    let mut q = ElementQuality {
        topological_dimension: N - 1,
        count: cells.len(),
        total_volume: 0.0,
        smallest_volume: first.volume,
        smallest: 0,
        largest_volume: first.volume,
        largest: 0,
        worst_mean_ratio: mean_ratio(&first, N),
        worst: 0,
        average_mean_ratio: 0.0,
        curved: None,
    };
    for (i, &cell) in cells.iter().enumerate() {
        let m = measure(&mesh.points, mesh.dimension, cell);
        let ratio = mean_ratio(&m, N);
        q.total_volume += m.volume;
        q.average_mean_ratio += ratio / cells.len() as f64;
        if m.volume < q.smallest_volume {
            (q.smallest_volume, q.smallest) = (m.volume, i);
        }
        if m.volume > q.largest_volume {
            (q.largest_volume, q.largest) = (m.volume, i);
        }
        if ratio < q.worst_mean_ratio {
            (q.worst_mean_ratio, q.worst) = (ratio, i);
        }
    }
    Some(q)
}

#[cfg(test)]
mod tests {
    use crate::spec::InlineSpec;
    use crate::test_support::{build_grid, build_inline, grid, points};

    #[test]
    fn regular_simplices_have_mean_ratio_one() {
        let [x, y] = [0.5, 3.0_f64.sqrt() / 2.0];
        let triangle = InlineSpec {
            points: points(&[[0.0, 0.0], [1.0, 0.0], [x, y]]),
            triangles: vec![[0, 1, 2]],
            ..InlineSpec::default()
        };
        let q = build_inline(&triangle, 2).unwrap().quality().elements.unwrap();
        assert!((q.worst_mean_ratio - 1.0).abs() < 1e-15, "{q:?}");
        assert!((q.total_volume - y / 2.0).abs() < 1e-15);
        let alternate_corners = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        let solid = InlineSpec {
            points: points(&alternate_corners),
            tetrahedra: vec![[0, 1, 3, 2]],
            ..InlineSpec::default()
        };
        let q = build_inline(&solid, 3).unwrap().quality().elements.unwrap();
        assert!((q.worst_mean_ratio - 1.0).abs() < 1e-15, "{q:?}");
        assert!((q.total_volume - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn extremes_are_found_with_their_indices() {
        let spec = InlineSpec {
            points: points(&[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [-0.1, 0.0], [0.0, -8.0]]),
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 4, 1]],
            ..InlineSpec::default()
        };
        let quality = build_inline(&spec, 2).unwrap().quality();
        assert_eq!((quality.lower, quality.upper), (vec![-0.1, -8.0], vec![2.0, 2.0]));
        let q = quality.elements.unwrap();
        assert_eq!((q.count, q.topological_dimension), (3, 2));
        assert_eq!((q.smallest, q.largest, q.worst), (1, 2, 1));
        assert!((q.total_volume - 10.1).abs() < 1e-14);
        // Right isosceles triangle: 4 sqrt(3) 2 / (4 + 4 + 8).
        let ratios = [3.0_f64.sqrt() / 2.0, 0.4 * 3.0_f64.sqrt() / 8.02, 32.0 * 3.0_f64.sqrt() / 136.0];
        assert!((q.worst_mean_ratio - ratios[1]).abs() < 1e-15);
        assert!((q.average_mean_ratio - ratios.iter().sum::<f64>() / 3.0).abs() < 1e-15);
    }

    #[test]
    fn grids_are_of_even_quality() {
        let q = build_grid(&grid(&[3, 3, 3], 0.1), 3).unwrap().quality().elements.unwrap();
        // Every Kuhn tetrahedron: V = 1/6, squared edges 1 + 1 + 1 + 2 + 2 + 3.
        let expected = 12.0 * 0.5_f64.powf(2.0 / 3.0) / 10.0;
        assert!(
            (q.worst_mean_ratio - expected).abs() < 1e-14 && (q.average_mean_ratio - expected).abs() < 1e-14
        );
        assert!((q.total_volume - 0.027).abs() < 1e-16);
    }

    #[test]
    fn points_have_no_elements() {
        let spec = InlineSpec { points: points(&[[0.0, 0.0]]), ..InlineSpec::default() };
        assert!(build_inline(&spec, 2).unwrap().quality().elements.is_none());
    }
}
