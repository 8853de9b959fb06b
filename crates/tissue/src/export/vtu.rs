//! ParaView files: one VTU (XML unstructured grid, base64 arrays) a frame and a PVD that gives each
//! its time. Layout: VTK file formats, "XML file formats", unstructured grid, header UInt64.

use crate::tensors::write_whole;
use base64::Engine;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Elements of a frame's file.
#[derive(Clone, Copy, Debug)]
pub enum Cells<'a> {
    /// `[T, 4]`.
    Tets(&'a [[u32; 4]]),
    /// `[F, 3]`.
    Triangles(&'a [[u32; 3]]),
}

impl Cells<'_> {
    fn count(&self) -> usize {
        match self {
            Cells::Tets(cells) => cells.len(),
            Cells::Triangles(cells) => cells.len(),
        }
    }

    /// VTK's cell type and nodes a cell.
    fn kind(&self) -> (u8, usize) {
        match self {
            Cells::Tets(_) => (10, 4),
            Cells::Triangles(_) => (5, 3),
        }
    }

    fn nodes(&self) -> &[u32] {
        match self {
            Cells::Tets(cells) => cells.as_flattened(),
            Cells::Triangles(cells) => cells.as_flattened(),
        }
    }
}

/// Writes one frame: `points` `[K, 3]` mm, and the point arrays `displacement` `[K, 3]` mm and
/// `contact` `[K]` (1 where an instrument holds the node). The file is whole or absent.
///
/// Panics when the arrays do not have `K` rows.
pub fn write_frame(
    path: &Path,
    points: &[[f32; 3]],
    cells: Cells<'_>,
    displacement: &[[f32; 3]],
    contact: &[u8],
) -> io::Result<()> {
    assert_eq!(points.len(), displacement.len(), "one displacement a node");
    assert_eq!(points.len(), contact.len(), "one contact flag a node");
    let (kind, width) = cells.kind();
    let floats = |rows: &[[f32; 3]]| -> Vec<u8> {
        rows.as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect()
    };
    let integers = |values: &mut dyn Iterator<Item = u32>| -> Vec<u8> {
        values
            .flat_map(|value| (value as i32).to_le_bytes())
            .collect()
    };
    let array = |kind: &str, name: &str, components: usize, data: Vec<u8>| {
        let mut bytes = (data.len() as u64).to_le_bytes().to_vec();
        bytes.extend(data);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"binary\">{}</DataArray>",
            base64::engine::general_purpose::STANDARD.encode(bytes)
        )
    };
    let moved = array("Float32", "displacement", 3, floats(displacement));
    let touched = array("UInt8", "contact", 1, contact.to_vec());
    let places = array("Float32", "Points", 3, floats(points));
    let nodes = integers(&mut cells.nodes().iter().copied());
    let nodes = array("Int32", "connectivity", 1, nodes);
    let ends = integers(&mut (1..=cells.count() as u32).map(|cell| cell * width as u32));
    let ends = array("Int32", "offsets", 1, ends);
    let types = array("UInt8", "types", 1, vec![kind; cells.count()]);
    write_whole(path, |file| {
        writeln!(file, "<?xml version=\"1.0\"?>")?;
        writeln!(
            file,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">"
        )?;
        writeln!(file, "<UnstructuredGrid>")?;
        writeln!(
            file,
            "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
            points.len(),
            cells.count()
        )?;
        writeln!(file, "<PointData Vectors=\"displacement\">")?;
        writeln!(file, "{moved}\n{touched}\n</PointData>")?;
        writeln!(file, "<Points>\n{places}\n</Points>")?;
        writeln!(file, "<Cells>\n{nodes}\n{ends}\n{types}\n</Cells>")?;
        writeln!(file, "</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    })
}

/// The frames of a PVD file, in order.
#[derive(Clone, Debug, Default)]
pub struct Collection {
    frames: Vec<(f64, PathBuf)>,
}

impl Collection {
    /// Adds a frame at `time_s`; `file` is relative to the PVD.
    pub fn push(&mut self, time_s: f64, file: impl Into<PathBuf>) {
        self.frames.push((time_s, file.into()));
    }

    /// Writes the PVD.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        write_whole(path, |file| {
            writeln!(file, "<?xml version=\"1.0\"?>")?;
            writeln!(
                file,
                "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">"
            )?;
            writeln!(file, "<Collection>")?;
            for (time, frame) in &self.frames {
                writeln!(
                    file,
                    "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>",
                    frame.display()
                )?;
            }
            writeln!(file, "</Collection>\n</VTKFile>")
        })
    }
}
