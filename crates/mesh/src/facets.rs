//! Grouping of facets with equal vertices.

/// Calls `visit` once for every set of vertices among `count` facets, with the ascending indices of the
/// facets that have these vertices. The sets come in the order of their lowest vertices.
///
/// `key` gives the ascending vertices of a facet. A counting sort by the lowest vertex leaves groups as
/// small as the number of facets around a vertex. It takes 4 bytes per facet and 4 per vertex; sorting
/// all keys together takes 20 and more per facet, which was the peak memory of assembling a scene of
/// solids.
pub(super) fn for_each_equal<const N: usize>(
    count: usize,
    key: impl Fn(usize) -> [u32; N],
    mut visit: impl FnMut(&[u32]),
) {
    let (mut facets, ends) = by_lowest_vertex(count, |i| key(i)[0] as usize);
    let mut start = 0;
    for end in ends {
        let group = &mut facets[start..end as usize];
        group.sort_unstable_by_key(|i| (key(*i as usize), *i));
        group.chunk_by(|a, b| key(*a as usize) == key(*b as usize)).for_each(&mut visit);
        start = end as usize;
    }
}

/// Indices of facets, grouped by lowest vertex, and the end of each vertex's group.
fn by_lowest_vertex(count: usize, lowest: impl Fn(usize) -> usize) -> (Vec<u32>, Vec<u32>) {
    let vertices = (0..count).map(|i| lowest(i) + 1).max().unwrap_or(0);
    let mut ends = vec![0u32; vertices + 1];
    (0..count).for_each(|i| ends[lowest(i) + 1] += 1);
    for v in 0..vertices {
        ends[v + 1] += ends[v];
    }
    // Starts of the groups: each becomes the end of its group as its facets are placed.
    let mut facets = vec![0u32; count];
    for i in 0..count {
        let place = &mut ends[lowest(i)];
        facets[*place as usize] = i as u32;
        *place += 1;
    }
    ends.pop();
    (facets, ends)
}

#[cfg(test)]
mod tests {
    use super::for_each_equal;

    /// Agrees with sorting all keys, for facets of three among eight vertices, many of them equal.
    #[test]
    fn sets_are_those_that_a_sort_of_all_keys_finds() {
        let mut state = 1u64;
        let mut vertex = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 61) as u32
        };
        let facets: Vec<[u32; 3]> = (0..300)
            .map(|_| {
                let mut facet = [vertex(), vertex(), vertex()];
                facet.sort_unstable();
                facet
            })
            .collect();
        let mut found = vec![];
        for_each_equal(facets.len(), |i| facets[i], |run| found.push(run.to_vec()));
        let mut keys: Vec<([u32; 3], u32)> = facets.iter().copied().zip(0..).collect();
        keys.sort_unstable();
        let indices = |run: &[([u32; 3], u32)]| run.iter().map(|(_, i)| *i).collect::<Vec<u32>>();
        let expected: Vec<Vec<u32>> = keys.chunk_by(|a, b| a.0 == b.0).map(indices).collect();
        assert!(expected.iter().any(|run| run.len() > 2) && expected.iter().any(|run| run.len() == 1));
        assert_eq!(found, expected);
    }

    #[test]
    fn no_facets_have_no_sets() {
        for_each_equal(0, |_| [0, 1], |_| panic!("a set of nothing"));
    }
}
