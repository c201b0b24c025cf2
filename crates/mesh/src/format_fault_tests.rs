//! Files written by meshio with a mistake added: position and message of the error.

use super::file::Format;
use super::format_tests::{MEDIT, SURFACES, VTK, VTU, changed, fault, read, with};
use super::{Cell, FileTag, MeshError, MidNodes};
use pliant_files::base64;

#[test]
fn faults_of_vtk_files_name_line_or_byte() {
    let ascii = VTK[2].1;
    let (line, _, message) = fault(Format::Vtk, &changed(ascii, "\n4\n1\n2\n3\n4", "\n4\n1\n2\n3\n5"));
    assert_eq!(message, "there is no vertex 5: the file has 5, numbered from 0");
    assert_eq!(line, 14, "the first vertex of the cell");
    let (line, _, message) = fault(Format::Vtk, &changed(ascii, "0.7 ", "nan "));
    assert!(line == 6 && message.starts_with("coordinate 2 of vertex 3 is NaN"), "{line} {message}");
    let (line, _, message) = fault(Format::Vtk, &changed(ascii, "CELLS 4 18", "CELLS 5 18"));
    assert!(message.starts_with("cells in the list: 4, but it must be 5"), "{line} {message}");
    let (_, _, message) = fault(Format::Vtk, &changed(ascii, "CELL_TYPES 4\n10", "CELL_TYPES 4\n13"));
    assert!(message.contains("6-node wedge (cell type 13)"), "{message}");
    let (_, _, message) = fault(Format::Vtk, &changed(ascii, "CELL_TYPES 4\n10", "CELL_TYPES 4\n5"));
    assert!(message.contains("vertices of a cell of its type: 4, but it must be 3"), "{message}");
    let (line, _, message) = fault(Format::Vtk, &changed(ascii, "UNSTRUCTURED_GRID", "STRUCTURED_POINTS"));
    assert!(line == 4 && message.contains("the dataset STRUCTURED_POINTS is not read"), "{message}");
    let (line, _, message) = fault(Format::Vtk, b"vtk\n");
    assert!(line == 1 && message.contains("# vtk DataFile Version"), "{message}");
    for (name, bytes) in VTK {
        for length in 0..bytes.len() - 2 {
            assert!(
                with(Format::Vtk, &bytes[..length], &[], 3, MidNodes::Refuse).is_err(),
                "{name} cut at {length}"
            );
        }
    }
    // Index 4 of the binary file becomes 5: the error is at the beginning of its cell.
    let mut binary = VTK[3].1.to_vec();
    let list = [0, 0, 0, 4, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4];
    let at = binary.windows(list.len()).position(|window| window == list).unwrap();
    binary[at + 19] = 5;
    let (line, tag, message) = fault(Format::Vtk, &binary);
    assert_eq!((line, tag), (0, Some(FileTag::Byte(at as u64 + 4))), "{message}");
    assert!(message.contains("there is no vertex 5"), "{message}");
}

/// One point more than declared is an error whatever follows it, and so are a million attributes.
#[test]
fn a_vtu_that_states_more_than_it_declares_is_not_unpacked() {
    let zeros = |count: usize| {
        let block = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 24 * count], 6);
        let header = [1, 24 * count as u32, 24 * count as u32, block.len() as u32];
        let bytes: Vec<u8> = header.iter().flat_map(|n| n.to_le_bytes()).chain(block).collect();
        base64::encode(&bytes)
    };
    let file = |points: usize, data: &str, attributes: &str| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\">
<!-- it's nothing --><UnstructuredGrid><Piece NumberOfPoints=\"{points}\" NumberOfCells=\"0\"{attributes}>
<Points><DataArray type=\"Float64\" format=\"binary\">{data}</DataArray></Points>
</Piece></UnstructuredGrid></VTKFile>"
        )
        .into_bytes()
    };
    let said = |file: Vec<u8>| fault(Format::Vtu, &file);
    let (line, _, message) = said(file(1000, &zeros(1001), ""));
    assert!(line == 3 && message.contains("states 24024 unpacked bytes"), "{line} {message}");
    let (line, _, message) = said(file(1000, &zeros(1000), ""));
    assert!(line == 2 && message.contains("<Cells> is missing"), "{line} {message}");
    let many = |count: usize| (0..count).map(|i| format!(" a{i}='>'")).collect::<String>();
    let (_, _, message) = said(file(1000, &zeros(1000), &many(200)));
    assert!(message.contains("<Cells> is missing"), "{message}");
    let (line, _, message) = said(file(1000, &zeros(1000), &many(100_000)));
    assert!(line == 2 && message.contains("100002 attributes"), "{line} {message}");
}

#[test]
fn faults_of_vtu_files_name_the_line() {
    let [ascii, binary, zlib] = [VTU[0].1, VTU[1].1, VTU[2].1];
    let (line, _, message) = fault(Format::Vtu, &changed(ascii, "7.00000000000e-01", "inf"));
    assert!(line == 17 && message.starts_with("coordinate 2 of vertex 3 is inf"), "{line} {message}");
    let (_, _, message) = fault(Format::Vtu, &changed(ascii, "NumberOfCells=\"4\"", "NumberOfCells=\"5\""));
    assert!(message.contains("offsets, one for each cell: 4, but it must be 5"), "{message}");
    let (_, _, message) = fault(Format::Vtu, &changed(ascii, "NumberOfPoints=\"5\"", "NumberOfPoints=\"6\""));
    assert!(message.contains("15, but it must be 18"), "{message}");
    let (_, _, message) = fault(Format::Vtu, &changed(ascii, "</Points>", "</Pints>"));
    assert!(message.contains("the XML is broken"), "{message}");
    let (_, _, message) = fault(Format::Vtu, &changed(ascii, "Name=\"types\"", "Name=\"kinds\""));
    assert!(message.contains("<DataArray Name=\"types\"> is missing"), "{message}");
    let (line, _, message) = fault(Format::Vtu, &changed(binary, "eAAA", "eAA*"));
    assert!(line == 7 && message.contains("character 5 is `*`, which is not base 64"), "{line} {message}");
    let (_, _, message) = fault(Format::Vtu, &changed(binary, "eAAA", "fAAA"));
    assert!(message.contains("it ends after 124 bytes where 128 bytes of lengths and data"), "{message}");
    let (_, _, message) = fault(Format::Vtu, &changed(zlib, "vtkZLib", "vtkLZMA"));
    assert!(message.contains("the compressor vtkLZMADataCompressor is not read"), "{message}");
    for (name, bytes) in VTU {
        for length in 0..bytes.len() - 12 {
            assert!(
                with(Format::Vtu, &bytes[..length], &[], 3, MidNodes::Refuse).is_err(),
                "{name} cut at {length}"
            );
        }
    }
}

#[test]
fn faults_of_ply_and_stl_files_name_line_or_byte() {
    let [ply, little, stl, binary] = [SURFACES[0].2, SURFACES[1].2, SURFACES[3].2, SURFACES[4].2];
    let (line, _, message) = fault(Format::Ply, &changed(ply, "3 2 0 3", "3 2 0 4"));
    assert_eq!((line, &message[..]), (18, "there is no vertex 4: the file has 4, numbered from 0"));
    let (line, tag, message) = fault(Format::Ply, &changed(ply, "0.1 0.2 0.7", "0.1 0.2 nan"));
    assert!(
        line == 14 && tag == Some(FileTag::Node(4)) && message.contains("vertex 3 is NaN"),
        "{line} {message}"
    );
    let (_, _, message) = fault(Format::Ply, &changed(ply, "property double z", "property double w"));
    assert!(message.contains("the element vertex without the property z"), "{message}");
    let (line, _, message) = fault(Format::Ply, &changed(ply, "3 2 0 3", "2 2 0 3"));
    assert!(line == 18 && message.contains("three vertices of a face"), "{line} {message}");
    let (_, _, message) = fault(Format::Ply, &changed(ply, "3 2 0 3", "3 2 0 2"));
    assert!(message.contains("uses vertex 2 more than once"), "{message}");
    let (line, tag, message) = fault(Format::Ply, &little[..little.len() - 1]);
    assert_eq!((line, tag), (0, Some(FileTag::Byte(little.len() as u64 - 4))), "{message}");
    let quad = changed(ply, "element face 4", "element face 1");
    let quad = changed(&quad, "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3", "4 0 1 2 3");
    assert_eq!(read(Format::Ply, &quad).triangles, [[0, 1, 2], [0, 2, 3]]);

    let (line, _, message) = fault(Format::Stl, &changed(stl, "vertex 1.0 0.0 0.0", "vertex 1.0 0.0 0,0"));
    assert!(message.contains("expected z of a vertex, found `0,0`"), "{line} {message}");
    let (line, _, message) = fault(Format::Stl, &changed(stl, "vertex 1.0 0.0 0.0", "vertex 0.0 0.0 0.0"));
    assert!(line == 2 && message.contains("triangle 0 uses vertex 0 more than once"), "{line} {message}");
    let (line, _, message) = fault(Format::Stl, &changed(stl, "vertex 1.0 0.0 0.0", "vertex inf 0.0 0.0"));
    assert!(line > 0 && message.contains("a coordinate is inf"), "{line} {message}");
    let (line, tag, message) = fault(Format::Stl, &binary[..binary.len() - 1]);
    assert_eq!((line, tag), (0, Some(FileTag::Byte(80))), "{message}");
    assert!(message.contains("199, but it must be 200"), "{message}");
    let mut nan = binary.to_vec();
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let (_, tag, message) = fault(Format::Stl, &nan);
    assert!(tag == Some(FileTag::Byte(134)) && message.contains("a coordinate is NaN"), "{tag:?} {message}");
    let mut flat = binary.to_vec();
    flat.copy_within(84 + 12..84 + 24, 84 + 24);
    let (_, tag, message) = fault(Format::Stl, &flat);
    assert!(tag == Some(FileTag::Byte(84)) && message.contains("more than once"), "{tag:?} {message}");
}

#[test]
fn faults_of_medit_files_name_the_line() {
    let (line, _, message) = fault(Format::Medit, &changed(MEDIT, "2 3 4 5 8", "2 3 4 6 8"));
    assert_eq!((line, &message[..]), (15, "there is no vertex 6: the file has 5, numbered from 1"));
    let (line, tag, message) = fault(Format::Medit, &changed(MEDIT, "6.9999999999999996e-01", "NaN"));
    assert!(line == 9 && tag == Some(FileTag::Node(4)) && message.contains("NaN"), "{line} {message}");
    let (_, _, message) = fault(Format::Medit, &changed(MEDIT, "Triangles\n2", "Triangles\n3"));
    assert!(message.contains("expected the number of a vertex, found `End`"), "{message}");
    let (line, _, message) = fault(Format::Medit, &changed(MEDIT, "Triangles\n2", "Prisms\n2"));
    assert!(line == 18 && message.contains("the section Prisms is not read"), "{line} {message}");
    let (_, _, message) = fault(Format::Medit, &changed(MEDIT, "Formatted 2", "Formatted 4"));
    assert!(message.contains("version 4 of the format"), "{message}");
    let (line, tag, error) = {
        let (site, error) =
            with(Format::Medit, &changed(MEDIT, "2 3 4 5 8", "2 3 5 4 8"), &[], 3, MidNodes::Refuse)
                .unwrap_err();
        (site.line, site.tag, error)
    };
    assert!(matches!(error, MeshError::Inverted { cell: Cell::Tetrahedron(1), .. }), "{error}");
    assert_eq!((line, tag), (15, Some(FileTag::Element(2))));
}

/// Counts beyond any file, and elements without properties.
#[test]
fn announced_counts_are_not_believed() {
    let huge = u64::MAX;
    let head = "# vtk DataFile Version 5.1\n\nASCII\nDATASET UNSTRUCTURED_GRID\n";
    for (format, text) in [
        (Format::Vtk, format!("{head}POINTS {huge} float\n0 0 0\n")),
        (Format::Vtk, format!("{head}POINTS 0 float\nCELLS {huge} {huge}\nOFFSETS int\n0\n")),
        (Format::Vtk, format!("{head}FIELD f 1\na {huge} {huge} int\n0\n")),
        (Format::Medit, format!("MeshVersionFormatted 1\nDimension 3\nVertices {huge}\n0 0 0 0\n")),
        (Format::Ply, format!("ply\nformat ascii 1.0\nelement nothing {huge}\nend_header\n")),
        (
            Format::Ply,
            format!("ply\nformat ascii 1.0\nelement a 1\nproperty list uint int b\nend_header\n{huge} 1\n"),
        ),
    ] {
        let (_, error) = with(format, text.as_bytes(), &[], 3, MidNodes::Refuse).unwrap_err();
        assert!(matches!(error, MeshError::EndOfFile { .. } | MeshError::Empty), "{text}: {error}");
    }
    let vtu = changed(VTU[2].1, "UnstructuredGrid\" ", "UnstructuredGrid\" header_type=\"UInt64\" ");
    assert!(with(Format::Vtu, &vtu, &[], 3, MidNodes::Refuse).is_err());
}
