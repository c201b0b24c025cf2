//! Loads, stores, gathers and scatters.

use super::*;

/// Gathers rows, adds twice what was gathered to the same rows, and returns what was gathered.
struct GatherScatter<'a, const D: usize>(&'a mut Rows<D>, &'a [u16; WIDTH]);
impl<const D: usize> Kernel for GatherScatter<'_, D> {
    type Output = [[f64; WIDTH]; D];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let x: [L; D] = L::gather(self.0, self.1);
        let (mut out, mut twice) = ([[0.0; WIDTH]; D], x);
        for c in 0..D {
            x[c].store(&mut out[c]);
            twice[c] += x[c];
        }
        L::scatter_add(self.0, self.1, twice);
        out
    }
}

/// Rows in use, and numbers that hold them.
const ROWS: u16 = 300;
const USED: usize = 4 * ROWS as usize;

fn copy<const D: usize>(rows: &Rows<D>) -> Rows<D> {
    let mut r = Rows::new();
    for i in 0..ROWS {
        r.set(i, rows.get(i));
    }
    r
}

fn check_gather_scatter<const D: usize>() {
    let mut random = Pcg64Mcg::seed_from_u64(11);
    let rounds = if cfg!(miri) { 3 } else { 500 };
    for round in 0..rounds {
        let mut rows = Rows::<D>::new();
        for i in 0..ROWS {
            rows.set(i, std::array::from_fn(|_| uniform(&mut random) - 0.5));
        }
        // Many rounds with repeated indices, in which the order of the additions shows in the last bits.
        let range = if round % 2 == 0 { 3 } else { u64::from(ROWS) };
        let index: [u16; WIDTH] = std::array::from_fn(|_| (random.next_u64() % range) as u16);
        let mut expected = copy(&rows);
        let gathered = index.map(|i| rows.get(i));
        for l in 0..WIDTH {
            let mut row = expected.get(index[l]);
            for c in 0..D {
                row[c] += gathered[l][c] + gathered[l][c];
            }
            expected.set(index[l], row);
        }
        for level in Level::ALL {
            let mut after = copy(&rows);
            let out = dispatch_at(level, GatherScatter(&mut after, &index));
            for l in 0..WIDTH {
                for c in 0..D {
                    assert_eq!(out[c][l], gathered[l][c], "{level:?}, lane {l}");
                }
            }
            // This includes the padding, which stays zero.
            assert_eq!(after.as_slice()[..USED], expected.as_slice()[..USED], "{level:?}, {index:?}");
        }
    }
}

#[test]
fn gather_and_scatter_agree_with_rows_in_space() {
    check_gather_scatter::<3>();
}

#[test]
fn gather_and_scatter_agree_with_rows_in_the_plane() {
    check_gather_scatter::<2>();
}

#[test]
fn rows_hold_vertices() {
    let mut rows = Rows::<3>::new();
    rows.load_vertices(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], &[1, 0]);
    assert_eq!(rows.get(0), [3.0, 4.0, 5.0]);
    assert_eq!(rows.as_slice()[..8], [3.0, 4.0, 5.0, 0.0, 0.0, 1.0, 2.0, 0.0]);
    rows.clear(1);
    assert_eq!((rows.get(0), rows.get(1)), ([0.0; 3], [0.0, 1.0, 2.0]));
}

#[test]
fn every_index_has_a_row() {
    let mut rows = Rows::<3>::new();
    rows.set(u16::MAX, [1.0, 2.0, 3.0]);
    for level in Level::ALL {
        rows.set(u16::MAX, [1.0, 2.0, 3.0]);
        let out = dispatch_at(level, GatherScatter(&mut rows, &[u16::MAX; WIDTH]));
        assert_eq!(out, [[1.0; WIDTH], [2.0; WIDTH], [3.0; WIDTH]]);
        assert_eq!(rows.get(u16::MAX), [17.0, 34.0, 51.0]);
    }
}

struct Copy<'a>(&'a [f64], &'a mut [f64]);
impl Kernel for Copy<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (from, to) = (self.0.as_chunks().0, self.1.as_chunks_mut().0);
        for i in 0..from.len() {
            L::load(&from[i]).store(&mut to[i]);
        }
    }
}

#[test]
fn loads_and_stores_need_no_alignment() {
    let from: Vec<f64> = (0..40).map(f64::from).collect();
    for level in Level::ALL {
        for offset in 0..8 {
            let mut to = vec![0.0; 40];
            dispatch_at(level, Copy(&from[offset..offset + 24], &mut to[offset + 1..offset + 25]));
            assert_eq!(to[offset + 1..offset + 25], from[offset..offset + 24]);
        }
    }
}

#[test]
fn rows_begin_at_a_cache_line() {
    let kept: Vec<_> = (0..4).map(|_| Rows::<3>::new()).collect();
    assert!(kept.iter().all(|rows| (rows.as_slice().as_ptr() as usize).is_multiple_of(64)));
}
