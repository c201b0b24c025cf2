//! Stencils (elements, or other terms that join a few vertices) grouped into patches: the main loop over
//! elements.
//!
//! Each patch has its own list of vertices and numbers them locally, so that a kernel works in scratch memory
//! that fits the first-level cache. The patch writes out its sums per vertex; afterwards every vertex adds
//! the few patches that touch it, in a fixed order. Patches depend on the mesh alone, never on the number of
//! threads: the result is bit-identical on one thread and on eight, without atomics and without colouring.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use super::Stencils;
use super::rows::{CopyKernel, IndexRun};
use crate::lanes::{Rows, VertexRows, WIDTH, copy_points, dispatch, filled, prefetch_all, with_room};

/// Stencils a patch holds at most. 800 to 1,500 tetrahedra worked best: their vertices fit the L1 and L2
/// caches.
const PATCH_STENCILS: usize = 1024;

/// Below this number of patches, other threads cost more than they save.
const PARALLEL_FROM_PATCHES: usize = 4;

/// Number of packs whose reference data, some 640 bytes each, no longer fit a cache. Below it prefetching
/// costs some percent.
const STREAMED_FROM: usize = 1 << 15;

/// Maximum number of tasks: enough to balance the load, few enough to keep scratch memory small.
const MAX_TASKS: usize = 32;

/// Vertices of `WIDTH` stencils, local to the patch, `index[node][lane]`.
pub type PackIndex<const N: usize> = [[u16; WIDTH]; N];

/// Local copies of the vertices of a patch.
#[derive(Debug, Default)]
pub struct Scratch<const D: usize> {
    /// Positions of the vertices.
    pub position: Rows<D>,
    /// Displacements of the vertices, for products with the Hessian.
    pub direction: Rows<D>,
    /// Contributions of the patch to the gradient.
    pub gradient: Rows<D>,
}

impl<const D: usize> Scratch<D> {
    /// Creates scratch memory for any patch.
    pub fn new() -> Self {
        Self::default()
    }
}

/// Preallocated memory of a term made of stencils: a step allocates nothing.
#[derive(Debug)]
pub struct Workspace<const D: usize> {
    /// Scratch memory of each task that may run at the same time.
    scratch: Vec<Scratch<D>>,
    /// Rows of sums, patch by patch.
    sums: Vec<f64>,
    /// One number for each patch.
    parts: Vec<f64>,
}

impl<const D: usize> Workspace<D> {
    /// Allocates the memory for `patches`.
    pub fn new<const N: usize>(patches: &Patches<N>) -> Self {
        let count = patches.patches.len();
        let tasks = tasks(count);
        let (sums, parts) = (filled(0.0, count * patches.per_patch::<D>()), vec![0.0; count]);
        Workspace { scratch: (0..tasks).map(|_| Scratch::new()).collect(), sums, parts }
    }

    /// Returns the address space [bytes] that scratch memory for `stencils` stencils reserves, most of
    /// which is never backed by memory.
    pub fn reserved_bytes(stencils: u64) -> u64 {
        let patches = usize::try_from(stencils.div_ceil(PATCH_STENCILS as u64)).unwrap_or(usize::MAX);
        tasks(patches) as u64 * 3 * Rows::<D>::BYTES as u64
    }
}

/// Returns the number of tasks for `patches` patches.
fn tasks(patches: usize) -> usize {
    if patches < PARALLEL_FROM_PATCHES { 1 } else { patches.min(MAX_TASKS) }
}

/// Group of stencils that a kernel processes at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Index of the patch.
    pub number: usize,
    /// Packs of the patch.
    pub packs: Range<usize>,
    /// Range of the patch in [`Patches::vertices`].
    pub vertices: Range<usize>,
    /// Range of the patch in `Patches::runs`.
    runs: Range<usize>,
}

/// Number of vertices that are summed together; runs end at its multiples.
const BLOCK: u32 = 128;

/// Stencils of `N` vertices, grouped.
#[derive(Clone, Debug)]
pub struct Patches<const N: usize> {
    /// The patches, in order.
    pub patches: Vec<Patch>,
    /// Vertices of every pack, local to its patch.
    pub index: Vec<PackIndex<N>>,
    /// Original number of the stencil in every lane; `None` in the lanes that fill up the last pack of a
    /// patch.
    pub stencil: Vec<[Option<u32>; WIDTH]>,
    /// Global vertex of every local one, patch by patch.
    pub vertices: Vec<u32>,
    /// Rows that each patch has in an array of sums: the largest number of vertices of any patch.
    pub stride: usize,
    /// Sources of the positions of each patch, rows counted within the patch.
    runs: Vec<IndexRun>,
    /// Sources of the sums of each block of vertices, rows counted over all patches: those of block `i` are
    /// `sum_runs[block_start[i]..block_start[i + 1]]`, in the order of the patches.
    sum_runs: Vec<IndexRun>,
    block_start: Vec<u32>,
}

impl<const N: usize> Patches<N> {
    /// Groups `stencils` in the order that `order` lists; neighbours should follow one another. A patch
    /// has at most as many vertices as scratch memory has rows.
    pub fn new<const D: usize>(stencils: &[[u32; N]], order: &[u32], vertex_count: usize) -> Self {
        let mut patches = Self {
            patches: vec![],
            // With a pack to spare for each patch, if these are full.
            index: with_room(order.len() / WIDTH + order.len() / PATCH_STENCILS + 1),
            stencil: vec![],
            vertices: vec![],
            stride: 0,
            runs: vec![],
            sum_runs: vec![],
            block_start: vec![],
        };
        // Patch that last contained each vertex, and the local index of the vertex there.
        let mut seen = vec![(u32::MAX, 0u16); vertex_count];
        let mut first = 0;
        while first < order.len() {
            first += patches.push_patch(stencils, &order[first..], Rows::<D>::CAPACITY, &mut seen);
        }
        patches.link_sums(vertex_count);
        patches
    }

    /// Appends a patch of the first stencils of `order`; returns their number.
    fn push_patch(
        &mut self,
        stencils: &[[u32; N]],
        order: &[u32],
        capacity: usize,
        seen: &mut [(u32, u16)],
    ) -> usize {
        let id = self.patches.len() as u32;
        let (pack0, row0) = (self.index.len(), self.vertices.len());
        let mut count: usize = 0;
        for &stencil in order.iter().take(PATCH_STENCILS) {
            let stencil = &stencils[stencil as usize];
            let fresh = stencil.iter().filter(|&&v| seen[v as usize].0 != id).count();
            if self.vertices.len() - row0 + fresh > capacity {
                break;
            }
            for &v in stencil {
                if seen[v as usize].0 != id {
                    seen[v as usize].0 = id;
                    self.vertices.push(v);
                }
            }
            count += 1;
        }
        // Rows in the order of the global vertices: copying positions in and out is then nearly sequential.
        self.vertices[row0..].sort_unstable();
        for (local, &v) in self.vertices[row0..].iter().enumerate() {
            seen[v as usize].1 = local as u16;
        }
        // Each lane takes a contiguous part of the order: the lanes of a pack are far apart and rarely
        // share a vertex, so that their additions to rows need not wait for one another.
        let packs = count.div_ceil(WIDTH);
        for pack in 0..packs {
            let mut index = [[0u16; WIDTH]; N];
            let mut stencil = [None; WIDTH];
            let mut source = &stencils[order[pack] as usize];
            for lane in 0..WIDTH {
                // Padding lanes, the last ones, repeat the stencil before them, with weight zero.
                if let Some(&own) = order[..count].get(lane * packs + pack) {
                    stencil[lane] = Some(own);
                    source = &stencils[own as usize];
                }
                for node in 0..N {
                    index[node][lane] = seen[source[node] as usize].1;
                }
            }
            self.index.push(index);
            self.stencil.push(stencil);
        }
        self.stride = self.stride.max(self.vertices.len() - row0);
        let run0 = self.runs.len();
        self.runs.extend(IndexRun::of(&self.vertices[row0..], 0, u32::MAX));
        self.patches.push(Patch {
            number: self.patches.len(),
            packs: pack0..self.index.len(),
            vertices: row0..self.vertices.len(),
            runs: run0..self.runs.len(),
        });
        count
    }

    /// Finds for every block of vertices the rows that hold its sums, patch by patch.
    fn link_sums(&mut self, vertex_count: usize) {
        let mut start = vec![0u32; vertex_count.div_ceil(BLOCK as usize) + 1];
        let runs = |patches: &Self, visit: &mut dyn FnMut(IndexRun)| {
            for (id, patch) in patches.patches.iter().enumerate() {
                let vertices = &patches.vertices[patch.vertices.clone()];
                IndexRun::of(vertices, id * patches.stride, BLOCK).for_each(&mut *visit);
            }
        };
        let block = |run: IndexRun| (run.vertex / BLOCK) as usize;
        runs(self, &mut |run| start[block(run) + 1] += 1);
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut sum_runs =
            vec![IndexRun { vertex: 0, row: 0, count: 0 }; start.last().map_or(0, |n| *n as usize)];
        runs(self, &mut |run| {
            sum_runs[next[block(run)] as usize] = run;
            next[block(run)] += 1;
        });
        (self.sum_runs, self.block_start) = (sum_runs, start);
    }

    /// Returns the length of a patch's part of an array of sums.
    fn per_patch<const D: usize>(&self) -> usize {
        self.stride * Rows::<D>::STRIDE
    }

    /// Stores in `workspace` the gradient rows that `kernel` fills for each patch; returns true if they
    /// are finite. The kernel finds the positions `x` of its vertices in its scratch memory, and the
    /// `direction` if there is one.
    pub fn evaluate<const D: usize>(
        &self,
        workspace: &mut Workspace<D>,
        x: &[f64],
        direction: Option<&[f64]>,
        kernel: impl Fn(&Patch, &mut Scratch<D>) + Sync + Send,
    ) -> bool {
        let Workspace { scratch, sums, .. } = workspace;
        let finite = AtomicBool::new(true);
        self.for_each(scratch, sums, self.per_patch::<D>(), &|patch, scratch, out| {
            self.load(patch, x, &mut scratch.position);
            if let Some(direction) = direction {
                self.load(patch, direction, &mut scratch.direction);
            }
            let rows = patch.vertices.len();
            scratch.gradient.clear(rows);
            self.ask_for_next::<D>(patch, x);
            kernel(patch, scratch);
            let from = &scratch.gradient.as_slice()[..rows * Rows::<D>::STRIDE];
            if !dispatch(CopyKernel { from, to: &mut out[..from.len()] }) {
                finite.store(false, Ordering::Relaxed);
            }
        });
        finite.into_inner()
    }

    /// Evaluates as [`evaluate`](Self::evaluate) does with a `direction`, and also returns the sum of the
    /// kernel's results, in the order of the patches.
    pub fn evaluate_with_sum<const D: usize>(
        &self,
        workspace: &mut Workspace<D>,
        x: &[f64],
        direction: &[f64],
        kernel: impl Fn(&Patch, &mut Scratch<D>) -> f64 + Sync + Send,
    ) -> f64 {
        // Bits of numbers, because several threads write them, each its own.
        let parts: Vec<AtomicU64> = self.patches.iter().map(|_| AtomicU64::new(0)).collect();
        self.evaluate(workspace, x, Some(direction), |patch, scratch| {
            let part = kernel(patch, scratch);
            parts[patch.number].store(part.to_bits(), Ordering::Relaxed);
        });
        parts.into_iter().map(|part| f64::from_bits(part.into_inner())).sum()
    }

    /// Adds rows of the last evaluated gradient to `g`, as many as `g` has, from vertex `first` on: for
    /// each vertex the rows of the patches that touch it, in the order of the patches.
    pub fn add_rows<const D: usize>(&self, workspace: &Workspace<D>, first: usize, g: &mut [f64]) {
        let end = first + g.len() / D;
        let blocks = first / BLOCK as usize..end.div_ceil(BLOCK as usize).min(self.block_start.len() - 1);
        let runs = &self.sum_runs[self.block_start[blocks.start] as usize
            ..self.block_start[blocks.end.max(blocks.start)] as usize];
        // Prefetch the rows of the next block: they are scattered in short runs.
        let next = blocks.end.max(blocks.start);
        if let Some(end) = self.block_start.get(next + 1).filter(|_| self.exceed_caches()) {
            for run in &self.sum_runs[self.block_start[next] as usize..*end as usize] {
                let rows = run.row as usize * Rows::<D>::STRIDE;
                prefetch_all(&workspace.sums[rows..][..run.count as usize * Rows::<D>::STRIDE]);
            }
        }
        for run in runs {
            // Skip the rows before the requested ones.
            let skipped = first.saturating_sub(run.vertex as usize);
            let vertex = run.vertex as usize + skipped;
            let count = (run.count as usize).saturating_sub(skipped).min(end.saturating_sub(vertex));
            if count == 0 {
                continue;
            }
            let rows = &workspace.sums[(run.row as usize + skipped) * Rows::<D>::STRIDE..];
            let out = g[(vertex - first) * D..][..count * D].as_chunks_mut::<D>().0;
            for (out, row) in out.iter_mut().zip(rows.chunks_exact(Rows::<D>::STRIDE)) {
                for c in 0..D {
                    out[c] += row[c];
                }
            }
        }
    }

    /// Returns the rows that [`add_rows`](Self::add_rows) would add for vertices of one block, if a
    /// single patch touches them and its rows have no gaps: in 2D, inside a patch.
    pub fn rows<'a, const D: usize>(
        &self,
        workspace: &'a Workspace<D>,
        first: usize,
        count: usize,
    ) -> Option<&'a [f64]> {
        let block = first / BLOCK as usize;
        let range = self.block_start.get(block..block + 2)?;
        let [run] = self.sum_runs[range[0] as usize..range[1] as usize] else { return None };
        let skipped = first.checked_sub(run.vertex as usize)?;
        let covers = skipped + count <= run.count as usize && Rows::<D>::STRIDE == D;
        covers.then(|| &workspace.sums[(run.row as usize + skipped) * D..][..count * D])
    }

    /// Copies the rows of the vertices of `patch` from a flat array.
    fn load<const D: usize>(&self, patch: &Patch, x: &[f64], rows: &mut Rows<D>) {
        for run in &self.runs[patch.runs.clone()] {
            rows.load(run.row as usize, &x[run.vertex as usize * D..][..run.count as usize * D]);
        }
    }

    /// Copies the rows of the vertices of `patch` to rows of all vertices.
    pub(crate) fn copy<const D: usize>(&self, patch: &Patch, x: &[f64], rows: &mut VertexRows<D>) {
        let stride = VertexRows::<D>::STRIDE;
        for run in &self.runs[patch.runs.clone()] {
            let points = &x[run.vertex as usize * D..][..run.count as usize * D];
            copy_points::<D>(points, &mut rows.as_mut_slice()[run.row as usize * stride..]);
        }
    }

    /// Returns the global vertices of a lane; `pack` counts from the first pack of the patch.
    pub(crate) fn vertices_of(&self, patch: &Patch, pack: usize, lane: usize) -> [u32; N] {
        let local = &self.vertices[patch.vertices.clone()];
        self.index[patch.packs.start + pack].map(|rows| local[rows[lane] as usize])
    }

    /// True if the data read in a pass over the stencils exceed the caches, so that prefetching pays.
    pub fn exceed_caches(&self) -> bool {
        self.index.len() >= STREAMED_FROM
    }

    /// Prefetches the positions of about the next patch while this one is computed.
    fn ask_for_next<const D: usize>(&self, patch: &Patch, x: &[f64]) {
        if !self.exceed_caches() {
            return;
        }
        let next = patch.runs.end..(patch.runs.end + patch.runs.len()).min(self.runs.len());
        for run in &self.runs[next] {
            prefetch_all(&x[run.vertex as usize * D..][..run.count as usize * D]);
        }
    }

    /// Sums the kernel's results in the order of the patches.
    pub fn sum<const D: usize>(
        &self,
        workspace: &mut Workspace<D>,
        x: &[f64],
        kernel: impl Fn(&Patch, &mut Scratch<D>) -> f64 + Sync + Send,
    ) -> f64 {
        let mut parts = std::mem::take(&mut workspace.parts);
        self.map(workspace, x, &mut parts, kernel);
        workspace.parts = parts;
        workspace.parts.iter().sum()
    }

    /// Sums as [`sum`](Self::sum) does, with a `direction` in the scratch memory.
    pub fn sum_along<const D: usize>(
        &self,
        workspace: &mut Workspace<D>,
        x: &[f64],
        direction: &[f64],
        kernel: impl Fn(&Patch, &mut Scratch<D>) -> f64 + Sync + Send,
    ) -> f64 {
        let Workspace { scratch, parts, .. } = workspace;
        self.for_each(scratch, parts, 1, &|patch, scratch, out| {
            self.load(patch, x, &mut scratch.position);
            self.load(patch, direction, &mut scratch.direction);
            out[0] = kernel(patch, scratch);
        });
        parts.iter().sum()
    }

    /// Writes the kernel's result for each patch to `out`.
    pub fn map<const D: usize, R: Send>(
        &self,
        workspace: &mut Workspace<D>,
        x: &[f64],
        out: &mut [R],
        kernel: impl Fn(&Patch, &mut Scratch<D>) -> R + Sync + Send,
    ) {
        self.for_each(&mut workspace.scratch, out, 1, &|patch, scratch, out| {
            self.load(patch, x, &mut scratch.position);
            out[0] = kernel(patch, scratch);
        });
    }

    /// Runs `kernel` on every patch with its `per_patch` entries of `out`, on several threads if there is
    /// enough work. The results do not depend on the thread. The kernel is called by pointer, once per patch,
    /// so that the long distribution loop is compiled only once.
    fn for_each<const D: usize, R: Send>(
        &self,
        scratch: &mut [Scratch<D>],
        out: &mut [R],
        per_patch: usize,
        kernel: &(dyn Fn(&Patch, &mut Scratch<D>, &mut [R]) + Sync),
    ) {
        if self.patches.is_empty() {
            return;
        }
        let run = |scratch: &mut Scratch<D>, patches: &[Patch], out: &mut [R]| {
            for (patch, out) in patches.iter().zip(out.chunks_mut(per_patch)) {
                kernel(patch, scratch, out);
            }
        };
        if scratch.len() == 1 || rayon::current_num_threads() == 1 {
            run(&mut scratch[0], &self.patches, out);
            return;
        }
        let per_task = self.patches.len().div_ceil(scratch.len());
        let tasks = self.patches.par_chunks(per_task).zip(out.par_chunks_mut(per_task * per_patch));
        tasks.zip(scratch).for_each(|((patches, out), scratch)| run(scratch, patches, out));
    }

    /// Returns every stencil, patch by patch: original number, global vertices, pack and lane.
    pub fn stencils(&self) -> impl Iterator<Item = (usize, [u32; N], usize, usize)> {
        self.patches.iter().flat_map(move |patch| {
            let vertices = &self.vertices[patch.vertices.clone()];
            patch.packs.clone().flat_map(move |pack| {
                (0..WIDTH).filter_map(move |lane| {
                    let mut global = [0; N];
                    for node in 0..N {
                        global[node] = vertices[self.index[pack][node][lane] as usize];
                    }
                    self.stencil[pack][lane].map(|stencil| (stencil as usize, global, pack, lane))
                })
            })
        })
    }

    /// Returns every lane of every pack as a stencil: lane `i % WIDTH` of pack `i / WIDTH` is number `i`.
    /// Padding lanes repeat another.
    pub(crate) fn lanes(&self) -> Stencils {
        let count = self.index.len() * WIDTH;
        Stencils { size: N, vertices: self.lanes_in(0..count).flat_map(|(vertices, ..)| vertices).collect() }
    }

    /// Returns global vertices, pack and lane of each of these stencils.
    pub(crate) fn lanes_in(&self, stencils: Range<usize>) -> impl Iterator<Item = ([u32; N], usize, usize)> {
        let mut number = self.patches.partition_point(|p| p.packs.end * WIDTH <= stencils.start);
        stencils.map(move |stencil| {
            let (pack, lane) = (stencil / WIDTH, stencil % WIDTH);
            while self.patches[number].packs.end <= pack {
                number += 1;
            }
            let patch = &self.patches[number];
            (self.vertices_of(patch, pack - patch.packs.start, lane), pack, lane)
        })
    }
}
