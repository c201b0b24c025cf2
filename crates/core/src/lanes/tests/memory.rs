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
        for level in InstructionSet::ALL {
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
    rows.load(1, &[0.0, 1.0, 2.0]);
    rows.load(0, &[3.0, 4.0, 5.0]);
    assert_eq!(rows.get(0), [3.0, 4.0, 5.0]);
    assert_eq!(rows.as_slice()[..8], [3.0, 4.0, 5.0, 0.0, 0.0, 1.0, 2.0, 0.0]);
    rows.clear(1);
    assert_eq!((rows.get(0), rows.get(1)), ([0.0; 3], [0.0, 1.0, 2.0]));
}

#[test]
fn every_index_has_a_row() {
    let mut rows = Rows::<3>::new();
    rows.set(u16::MAX, [1.0, 2.0, 3.0]);
    for level in InstructionSet::ALL {
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
    for level in InstructionSet::ALL {
        for offset in 0..8 {
            let mut to = vec![0.0; 40];
            dispatch_at(level, Copy(&from[offset..offset + 24], &mut to[offset + 1..offset + 25]));
            assert_eq!(to[offset + 1..offset + 25], from[offset..offset + 24]);
        }
    }
}

#[test]
fn any_number_of_vertices_has_rows() {
    fn check<const D: usize>() {
        let count = 70_000;
        let mut rows = VertexRows::<D>::new(count);
        let stride = VertexRows::<D>::STRIDE;
        for (i, row) in rows.as_mut_slice().chunks_exact_mut(stride).take(count).enumerate() {
            for c in 0..D {
                row[c] = (i * D + c) as f64;
            }
        }
        let index = [0, 1, 65_535, 65_536, 69_999, 69_999, 17, 3];
        struct Gather<'a, const D: usize>(&'a VertexRows<D>, &'a [u32; WIDTH]);
        impl<const D: usize> Kernel for Gather<'_, D> {
            type Output = [[f64; WIDTH]; D];
            #[inline(always)]
            fn run<L: Lanes>(self) -> Self::Output {
                let x: [L; D] = L::gather(self.0, self.1);
                let mut out = [[0.0; WIDTH]; D];
                for c in 0..D {
                    x[c].store(&mut out[c]);
                }
                out
            }
        }
        for level in InstructionSet::ALL {
            let out = dispatch_at(level, Gather(&rows, &index));
            for (c, out) in out.iter().enumerate() {
                assert_eq!(*out, index.map(|i| f64::from(i) * D as f64 + c as f64), "{level:?}");
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
#[should_panic(expected = "out of bounds")]
fn a_vertex_without_a_row_is_refused() {
    VertexRows::<3>::new(2).components(2);
}

/// Takes rows apart, stores the columns, and puts twice the columns together again.
struct Interleave<'a, const D: usize>(&'a mut [[f64; D]; WIDTH]);
impl<const D: usize> Kernel for Interleave<'_, D> {
    type Output = [[f64; WIDTH]; D];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let x: [L; D] = L::load_interleaved(self.0);
        let (mut out, mut twice) = ([[0.0; WIDTH]; D], x);
        for c in 0..D {
            x[c].store(&mut out[c]);
            twice[c] += x[c];
        }
        L::store_interleaved(twice, self.0);
        out
    }
}

#[test]
fn rows_are_taken_apart_and_put_together() {
    fn check<const D: usize>() {
        let rows: [[f64; D]; WIDTH] =
            std::array::from_fn(|l| std::array::from_fn(|c| (10 * l + c + 1) as f64));
        for level in InstructionSet::ALL {
            let mut after = rows;
            let columns = dispatch_at(level, Interleave(&mut after));
            for l in 0..WIDTH {
                for c in 0..D {
                    assert_eq!((columns[c][l], after[l][c]), (rows[l][c], 2.0 * rows[l][c]), "{level:?}");
                }
            }
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn aligned_numbers_begin_at_a_cache_line() {
    let mut numbers = Aligned::packs(2);
    numbers.push([7.0; WIDTH]);
    numbers[3] = 5.0;
    assert_eq!(numbers.len(), 3 * WIDTH);
    assert_eq!((numbers[3], numbers.pack(2)), (5.0, &[7.0; WIDTH]));
    assert_eq!(numbers.as_ptr().addr() % 64, 0);
    assert!(Aligned::default().is_empty());
}

#[test]
fn rows_begin_at_a_cache_line() {
    let kept: Vec<_> = (0..4).map(|_| Rows::<3>::new()).collect();
    assert!(kept.iter().all(|rows| (rows.as_slice().as_ptr() as usize).is_multiple_of(64)));
}

struct Transpose<'a>(&'a mut [[f64; WIDTH]; WIDTH]);
impl Kernel for Transpose<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut v = [L::zero(); WIDTH];
        for c in 0..WIDTH {
            v[c] = L::load(&self.0[c]);
        }
        let v = L::transpose(v);
        for l in 0..WIDTH {
            v[l].store(&mut self.0[l]);
        }
    }
}

#[test]
fn columns_become_rows() {
    let rows: [[f64; WIDTH]; WIDTH] = std::array::from_fn(|l| std::array::from_fn(|c| (10 * l + c) as f64));
    for level in InstructionSet::ALL {
        let mut after = rows;
        dispatch_at(level, Transpose(&mut after));
        for l in 0..WIDTH {
            for c in 0..WIDTH {
                assert_eq!(after[l][c], rows[c][l], "{level:?}");
            }
        }
    }
}

struct LoadColumns<'a, const D: usize>(&'a Columns<D>, isize);
impl<const D: usize> Kernel for LoadColumns<'_, D> {
    type Output = [[f64; WIDTH]; D];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let v: [L; D] = self.0.view().load(self.1);
        let mut out = [[0.0; WIDTH]; D];
        for c in 0..D {
            v[c].store(&mut out[c]);
        }
        out
    }
}

fn check_columns<const D: usize>() {
    let count = 19;
    let value = |c: usize, i: isize| {
        if (0..count).contains(&i) { 100.0 * (c + 1) as f64 + i as f64 } else { 0.0 }
    };
    let mut columns = Columns::<D>::new(count as usize);
    for (c, column) in columns.each_mut().into_iter().enumerate() {
        (0..count).for_each(|i| column[i as usize] = value(c, i));
    }
    for level in InstructionSet::ALL {
        for from in -(WIDTH as isize)..=24 {
            let loaded = dispatch_at(level, LoadColumns(&columns, from));
            for c in 0..D {
                let expected: Vec<f64> = (from..from + WIDTH as isize).map(|i| value(c, i)).collect();
                assert_eq!(loaded[c].as_slice(), expected, "{level:?}, component {c} from {from} on");
            }
        }
    }
}

#[test]
fn columns_give_eight_vertices_from_anywhere_and_zeros_around_them() {
    check_columns::<2>();
    check_columns::<3>();
    for beyond in [-(WIDTH as isize) - 1, 25, isize::MAX, isize::MIN] {
        let columns = Columns::<3>::new(19);
        let caught = std::panic::catch_unwind(|| columns.view().load::<Portable>(beyond));
        assert!(caught.is_err(), "{beyond} is beyond the columns");
    }
}

#[test]
fn numbers_begin_at_a_cache_line_and_are_as_many_as_asked_for() {
    for length in [0, 1, 7, 8, 9, 240] {
        let numbers = Numbers::zeros(length);
        assert_eq!(numbers.len(), length);
        assert_eq!(numbers.as_ptr() as usize % 64, 0);
    }
    let given = [1.0, -2.0, 3.5];
    assert_eq!(*Numbers::from(&given[..]), given);
}

/// Spreads packs whose lane `l` of pack `i` is `100 l + i`.
struct SpreadPacks<'a> {
    count: usize,
    lanes: std::ops::Range<usize>,
    out: &'a mut [f64],
}
impl Kernel for SpreadPacks<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut packs = [L::zero(); 20];
        for i in 0..self.count {
            let mut numbers = [0.0; WIDTH];
            for l in 0..WIDTH {
                numbers[l] = 100.0 * l as f64 + i as f64;
            }
            packs[i] = L::load(&numbers);
        }
        spread(&packs[..self.count], self.lanes, self.out);
    }
}

#[test]
fn packs_are_spread_lane_by_lane() {
    for level in InstructionSet::ALL {
        for count in [1, 7, 8, 9, 16, 19] {
            for lanes in [0..8, 0..3, 5..8, 2..2] {
                let mut out = vec![-1.0; count * lanes.len() + 2];
                dispatch_at(level, SpreadPacks { count, lanes: lanes.clone(), out: &mut out });
                let numbers = lanes.flat_map(|l| (0..count).map(move |i| (100 * l + i) as f64));
                let expected: Vec<f64> = numbers.chain([-1.0; 2]).collect();
                assert_eq!(out, expected, "{level:?}, {count} packs");
            }
        }
    }
}

/// `(a + b) a - b` of rows, and sums of their lanes.
struct Halves<'a>(&'a [[f64; HALF]; HALF], f64);
impl Kernel for Halves<'_> {
    type Output = [[f64; HALF]; HALF + 1];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Halves(rows, b) = self;
        let b = L::Half::splat(b);
        let (mut out, mut packs) = ([[0.0; HALF]; HALF + 1], [b; HALF]);
        for k in 0..HALF {
            let a = L::Half::load(&rows[k]);
            packs[k] = (a + b) * a - b;
            packs[k].store(&mut out[k]);
        }
        L::Half::sums(packs).store(&mut out[HALF]);
        out
    }
}

#[test]
fn halves_of_packs_round_and_sum_alike() {
    let mut random = Pcg64Mcg::seed_from_u64(12);
    for _ in 0..if cfg!(miri) { 3 } else { 500 } {
        let rows: [[f64; HALF]; HALF] =
            std::array::from_fn(|_| std::array::from_fn(|_| 3.0 * (uniform(&mut random) - 0.5)));
        let b = uniform(&mut random);
        let values = rows.map(|row| row.map(|a| (a + b) * a - b));
        for level in InstructionSet::ALL {
            let out = dispatch_at(level, Halves(&rows, b));
            assert_eq!(out[..HALF], values, "{level:?}");
            assert_eq!(out[HALF], values.map(|[a, b, c, d]| (a + b) + (c + d)), "{level:?}");
        }
    }
}
