//! Embedded surface of a solid: each surface vertex is bound to the element that contains it or to the
//! nearest one.

use rayon::prelude::*;

use super::closed::ClosedSurface;
use super::exact::squared_distance;
use super::tree::{self, BoxCorners, BoxTree};
use crate::Mesh;
use crate::geometry::{cross, dot, subtract};
use pliant::topology::Skin;

/// Spatial search among the elements of a solid.
pub(super) struct ElementFinder<'a> {
    mesh: &'a Mesh,
    tree: BoxTree,
}

impl<'a> ElementFinder<'a> {
    /// Supports tetrahedra, and hexahedra that are axis-aligned boxes.
    pub(super) fn new(mesh: &'a Mesh) -> ElementFinder<'a> {
        let boxes: Vec<BoxCorners> = match mesh.block() {
            Some(block) => {
                block.of::<8>().iter().map(|cell| tree::around(mesh.nodes::<3, 8>(cell))).collect()
            }
            None => mesh.tetrahedra.iter().map(|cell| tree::around(mesh.nodes::<3, 4>(cell))).collect(),
        };
        ElementFinder { mesh, tree: BoxTree::new(&boxes) }
    }

    /// Element nearest to a point, and the distance [m], 0 inside.
    pub(super) fn nearest(&self, point: &[f64; 3]) -> Option<(usize, f64)> {
        let found = match self.mesh.block() {
            Some(block) => {
                let cells = block.of::<8>();
                self.tree.nearest(point, |i| {
                    tree::squared_distance(point, &tree::around(self.mesh.nodes::<3, 8>(&cells[i as usize])))
                })
            }
            None => self.tree.nearest(point, |i| {
                squared_distance_of(&self.mesh.nodes::<3, 4>(&self.mesh.tetrahedra[i as usize]), point)
            }),
        };
        found.map(|(element, square)| (element as usize, square.sqrt()))
    }

    /// Nodes of an element, and its shape functions at a point, which may lie outside.
    fn weights(&self, element: usize, point: &[f64; 3]) -> (Vec<u32>, Vec<f64>) {
        match self.mesh.block() {
            Some(block) => {
                let cell = &block.of::<8>()[element];
                let nodes = self.mesh.nodes::<3, 8>(cell);
                // Local coordinates in the box spanned by nodes 0 and 6.
                let share = [0, 1, 2].map(|c| (point[c] - nodes[0][c]) / (nodes[6][c] - nodes[0][c]));
                let weight = |node: &[f64; 3]| {
                    (0..3).fold(1.0, |product, c| {
                        product * if node[c] == nodes[0][c] { 1.0 - share[c] } else { share[c] }
                    })
                };
                (cell.to_vec(), nodes.iter().map(weight).collect())
            }
            None => {
                let cell = self.mesh.tetrahedra[element];
                (cell.to_vec(), barycentric(&self.mesh.nodes::<3, 4>(&cell), point).to_vec())
            }
        }
    }
}

/// Barycentric coordinates of a point, which sum to 1.
fn barycentric([a, b, c, d]: &[[f64; 3]; 4], point: &[f64; 3]) -> [f64; 4] {
    let [ab, ac, ad, ap] = [b, c, d, point].map(|x| subtract(*x, *a));
    let volume = dot(ab, cross(ac, ad));
    let [second, third, fourth] =
        [dot(ap, cross(ac, ad)), dot(ap, cross(ad, ab)), dot(ap, cross(ab, ac))].map(|part| part / volume);
    [1.0 - second - third - fourth, second, third, fourth]
}

/// Squared distance of a point from a tetrahedron [m^2]; 0 inside.
fn squared_distance_of(nodes: &[[f64; 3]; 4], point: &[f64; 3]) -> f64 {
    if barycentric(nodes, point).iter().all(|weight| *weight >= 0.0) {
        return 0.0;
    }
    let [a, b, c, d] = *nodes;
    let faces = [[b, c, d], [a, d, c], [a, b, d], [a, c, b]];
    faces.iter().map(|face| squared_distance(face, point)).fold(f64::INFINITY, f64::min)
}

/// Skin of a solid, and the distance of each of its triangles' centroids from the solid [m].
pub(super) fn bind(surface: &ClosedSurface, mesh: &Mesh) -> (Skin, Vec<f64>) {
    let finder = ElementFinder::new(mesh);
    // A solid has at least one element.
    let nearest = |point: &[f64; 3]| finder.nearest(point).unwrap_or((0, f64::INFINITY));
    let bound = |point: &[f64; 3]| finder.weights(nearest(point).0, point);
    let bound: Vec<(Vec<u32>, Vec<f64>)> = surface.points.par_iter().map(bound).collect();
    let of_triangle = |i: usize| nearest(&surface.middle(i));
    let found: Vec<(usize, f64)> = (0..surface.triangles.len()).into_par_iter().map(of_triangle).collect();
    let skin = Skin {
        triangles: surface.triangles.clone(),
        elements: found.iter().map(|(element, _)| *element as u32).collect(),
        width: bound.first().map_or(0, |(nodes, _)| nodes.len()),
        nodes: bound.iter().flat_map(|(nodes, _)| nodes).copied().collect(),
        weights: bound.iter().flat_map(|(_, weights)| weights).copied().collect(),
    };
    (skin, found.into_iter().map(|(_, distance)| distance).collect())
}
