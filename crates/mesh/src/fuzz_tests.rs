//! Malformed files: every input gives a mesh or an error, and never a panic.

use proptest::prelude::*;

use super::file::{Format, MeshInput};
use super::file_tests::{GMSH_41, MESHIO_22, SHEET, parse};
use super::format_tests::{GMSH_BINARY, MEDIT, METADATA, SURFACES, VTK, VTU};
use super::geometry::measure;
use super::{Mesh, MidNodes};
use crate::spec::FileSpec;

/// Properties of every accepted mesh.
fn is_sound(mesh: &Mesh) {
    assert!(mesh.points.iter().all(|x| x.is_finite()));
    let count = mesh.vertex_count() as u32;
    for group in mesh.groups.values() {
        assert!(group.vertices.is_sorted() && group.vertices.iter().all(|&v| v < count));
        assert!(group.cells.is_sorted());
        let cells = match group.topological_dimension {
            0 => count as usize,
            1 => mesh.lines.len().max(mesh.edges.len()),
            2 => mesh.triangles.len(),
            _ => mesh.tetrahedra.len(),
        };
        assert!(group.cells.iter().all(|&c| (c as usize) < cells));
    }
    assert!(mesh.unique_edges().iter().flatten().all(|&v| v < count));
    mesh.boundary_edges();
    mesh.quality();
    mesh.contents();
    super::check::check(mesh).unwrap();
}

/// Requests every cleaning step.
fn cleaned() -> FileSpec {
    let merge = Some(1e-3);
    FileSpec { merge, drop_degenerate: true, drop_unused: true, orient: true, ..FileSpec::default() }
}

fn read_all(bytes: &[u8]) {
    for &format in Format::ALL {
        for dimension in [2, 3] {
            if let Ok(mesh) = parse(format, bytes, dimension) {
                is_sound(&mesh);
            }
            let input = MeshInput { bytes, nodes: &[], mid_nodes: MidNodes::Refuse, spec: &cleaned() };
            if let Ok(mesh) = super::file::parse(format, &input, dimension) {
                is_sound(&mesh);
            }
        }
    }
}

/// A valid text file with a few words replaced by troublesome ones, truncated somewhere.
fn mutated() -> impl Strategy<Value = Vec<u8>> {
    const TROUBLE: [&str; 18] = [
        "0",
        "1",
        "2",
        "4",
        "15",
        "-1",
        "-9223372036854775808",
        "18446744073709551615",
        "99999999999999999999",
        "4294967295",
        "1e400",
        "nan",
        "1e-320",
        "$Nodes",
        "$EndElements",
        "\"",
        "\\\n",
        "é\0",
    ];
    let text = prop::sample::select(vec![MESHIO_22, GMSH_41, SHEET]);
    let exchange = (any::<prop::sample::Index>(), prop::sample::select(&TROUBLE[..]));
    (text, prop::collection::vec(exchange, 0..4), any::<Option<prop::sample::Index>>()).prop_map(
        |(text, exchanges, cut)| {
            // Line ends are separate words, so that lines can be joined too.
            let mut words: Vec<String> = text.split_inclusive([' ', '\n']).map(str::to_string).collect();
            for (index, with) in exchanges {
                let word = index.get_mut(&mut words[..]);
                let end = word.pop().unwrap_or(' ');
                *word = format!("{with}{end}");
            }
            let mut bytes = words.concat().into_bytes();
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            bytes
        },
    )
}

/// A valid file of any format with a few bytes replaced, truncated somewhere.
fn damaged() -> impl Strategy<Value = Vec<u8>> {
    let mut files: Vec<&[u8]> = vec![MEDIT];
    files.extend(GMSH_BINARY.iter().chain(&METADATA).map(|(_, bytes)| bytes));
    files.extend(VTK.iter().chain(&VTU).map(|(_, bytes)| bytes));
    files.extend(SURFACES.iter().map(|(_, _, bytes)| bytes));
    let exchange = (any::<prop::sample::Index>(), any::<u8>());
    (prop::sample::select(files), prop::collection::vec(exchange, 0..4), any::<Option<prop::sample::Index>>())
        .prop_map(|(file, exchanges, cut)| {
            let mut bytes = file.to_vec();
            for (index, with) in exchanges {
                *index.get_mut(&mut bytes[..]) = with;
            }
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            bytes
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_all(&bytes);
        for start in ["$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n", "$MeshFormat\n4.1 0 \
             8\n$EndMeshFormat\n$Entities "] {
            read_all(&[start.as_bytes(), &bytes].concat());
        }
    }

    #[test]
    fn mutated_files_are_read_without_a_panic(bytes in mutated()) {
        read_all(&bytes);
    }

    #[test]
    fn damaged_files_of_every_format_are_read_without_a_panic(bytes in damaged()) {
        read_all(&bytes);
        for mid_nodes in [MidNodes::Drop, MidNodes::Keep] {
            for &format in Format::ALL {
                for spec in [FileSpec::default(), cleaned()] {
                    let input = MeshInput { bytes: &bytes, nodes: &bytes, mid_nodes, spec: &spec };
                    if let Ok(mesh) = super::file::parse(format, &input, 3) {
                        is_sound(&mesh);
                    }
                }
            }
        }
    }

    /// The body does not depend on the tags of nodes nor on the order of nodes and elements in the file.
    #[test]
    fn tags_and_orders_of_a_file_do_not_matter(
        tags in Just((1..=27_u64).map(|i| i * i * 7).collect::<Vec<_>>()).prop_shuffle(),
        order in Just((0..27_usize).collect::<Vec<_>>()).prop_shuffle(),
        elements in Just((0..48_usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let grid = super::test_support::build_grid(&super::test_support::grid(&[2, 2, 2], 0.5), 3).unwrap();
        let mut two = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n27\n".to_string();
        let mut four = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 27 1 9999\n3 1 0 27\n".to_string();
        let line = |v: usize| format!("{} {} {}\n", grid.point(v)[0], grid.point(v)[1], grid.point(v)[2]);
        order.iter().for_each(|&v| two += &format!("{} {}", tags[v], line(v)));
        order.iter().for_each(|&v| four += &format!("{}\n", tags[v]));
        order.iter().for_each(|&v| four += &line(v));
        two += "$EndNodes\n$Elements\n48\n";
        four += "$EndNodes\n$Elements\n1 48 1 48\n3 1 4 48\n";
        for &e in &elements {
            let nodes = grid.tetrahedra[e].map(|v| tags[v as usize].to_string()).join(" ");
            two += &format!("{} 4 0 {nodes}\n", e + 1);
            four += &format!("{} {nodes}\n", e + 1);
        }
        let two = parse(Format::Gmsh, format!("{two}$EndElements\n").as_bytes(), 3).unwrap();
        let four = parse(Format::Gmsh, format!("{four}$EndElements\n").as_bytes(), 3).unwrap();
        prop_assert_eq!(&two, &four);
        for (i, &v) in order.iter().enumerate() {
            prop_assert_eq!(two.point(i), grid.point(v));
        }
        for (tetrahedron, &e) in two.tetrahedra.iter().zip(&elements) {
            prop_assert_eq!(tetrahedron.map(|v| order[v as usize] as u32), grid.tetrahedra[e]);
        }
        let back = |edges: Vec<[u32; 2]>| {
            let mut edges: Vec<_> = edges
                .iter()
                .map(|edge| { let mut e = edge.map(|v| order[v as usize] as u32); e.sort_unstable(); e })
                .collect();
            edges.sort_unstable();
            edges
        };
        prop_assert_eq!(back(two.unique_edges()), grid.unique_edges());
        prop_assert_eq!(two.surface_triangles().len(), 48);
    }

    /// Exchanging two vertices of a simplex changes the sign of its volume and nothing else.
    #[test]
    fn volumes_are_alternating(points in prop::collection::vec(-10.0..10.0_f64, 12)) {
        let volume = |cell: [u32; 4]| measure(&points, 3, cell).volume;
        let scale = measure(&points, 3, [0, 1, 2, 3]).size.powi(3);
        for odd in [[1, 0, 2, 3], [0, 2, 1, 3], [0, 1, 3, 2], [3, 1, 2, 0]] {
            prop_assert!((volume(odd) + volume([0, 1, 2, 3])).abs() <= 1e-14 * scale);
        }
        prop_assert!((volume([1, 2, 0, 3]) - volume([0, 1, 2, 3])).abs() <= 1e-14 * scale);
    }
}

/// A header may announce more than any machine's memory: the reader reads only what is present.
#[test]
fn announced_counts_are_not_believed() {
    let huge = u64::MAX;
    for text in [
        format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{huge}\n1 0 0 0\n"),
        format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 {huge} 1 {huge}\n3 1 0 {huge}\n1\n"),
        format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n{huge} 0 0 0\n1 0 0 0 {huge} 1\n"),
        format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{huge}\n2 1 \"a\"\n"),
        format!("{}{huge}\n", MESHIO_22.split("4\n1 4 2 7").next().unwrap()),
    ] {
        let (place, error) = parse(Format::Gmsh, text.as_bytes(), 3).unwrap_err();
        assert!(matches!(error, super::MeshError::EndOfFile { .. }), "{error}");
        assert!(place.is_some());
    }
}

/// Binary files with the largest count wherever a count may be.
#[test]
fn announced_binary_counts_are_not_believed() {
    for (name, bytes) in GMSH_BINARY {
        let start = bytes.windows(10).position(|window| window == b"$EndMeshFo").unwrap();
        for at in start..bytes.len() {
            for width in [4, 8] {
                let mut bytes = bytes.to_vec();
                // The bytes give a positive `int` in either byte order.
                bytes[at..].iter_mut().take(width).for_each(|byte| *byte = 0x7f);
                if let Ok(mesh) = parse(Format::Gmsh, &bytes, 3) {
                    is_sound(&mesh);
                }
            }
        }
        for length in 0..bytes.len() - 1 {
            assert!(parse(Format::Gmsh, &bytes[..length], 3).is_err(), "{name} cut at {length}");
        }
    }
}
