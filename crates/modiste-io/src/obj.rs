//! Wavefront OBJ: vertices, polygons and the groups they stand in; everything else in it is skipped.

use std::io::Write;
use std::path::Path;

use modiste_core::Vec3;

use crate::animated::{AnimatedMesh, normals};
use crate::text::{Line, lines, lossy};
use crate::{IoError, read_bytes, write_atomically};

/// The polygons of an OBJ as they stand in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polygons {
    /// Vertex positions, in the unit of the file.
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each polygon, counted from 0; three or more.
    pub polygons: Vec<Vec<u32>>,
    /// For each polygon the index of its group in `groups`.
    pub polygon_groups: Vec<u32>,
    /// Names of groups (`g`) or objects (`o`) in order of first use; polygons before any belong to "".
    pub groups: Vec<String>,
}

impl Polygons {
    /// The polygons cut into triangles, as a fan around the first corner.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.polygons
            .iter()
            .flat_map(|polygon| polygon.windows(2).skip(1).map(|edge| [polygon[0], edge[0], edge[1]]))
            .collect()
    }

    /// The polygons of one group.
    pub fn of_group<'a>(&'a self, name: &str) -> impl Iterator<Item = &'a [u32]> + use<'a> {
        let group = self.groups.iter().position(|group| group == name).and_then(|index| u32::try_from(index).ok());
        self.polygons
            .iter()
            .zip(&self.polygon_groups)
            .filter(move |(_, polygon_group)| Some(**polygon_group) == group)
            .map(|(polygon, _)| polygon.as_slice())
    }
}

/// Reads vertices and triangles (polygons are cut as fans).
///
/// # Errors
/// [`IoError`] naming the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), IoError> {
    let mesh = read_polygons(path)?;
    let triangles = mesh.triangles();
    Ok((mesh.vertices, triangles))
}

/// Reads vertices and polygons, quads kept.
///
/// # Errors
/// [`IoError`] naming the file and the line.
pub fn read_polygons(path: impl AsRef<Path>) -> Result<Polygons, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line, also when there is no vertex at all.
pub fn parse(bytes: &[u8], name: &str) -> Result<Polygons, IoError> {
    let text = lossy(bytes);
    let mut mesh = Polygons::default();
    let mut group = None;
    let mut last_used_line = 0;
    for line in lines(&text, name) {
        let content = line.text.split('#').next().unwrap_or_default();
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => mesh.vertices.push(line.point(&mut words, "three finite coordinates after v")?),
            Some("f") => {
                let polygon = words.map(|corner| corner_vertex(&line, corner, mesh.vertices.len()));
                let polygon = polygon.collect::<Result<Vec<u32>, _>>()?;
                if polygon.len() < 3 {
                    return Err(line.error("a face of three or more vertices", line.text));
                }
                mesh.polygons.push(polygon);
                mesh.polygon_groups.push(*group.get_or_insert_with(|| group_index(&mut mesh.groups, "")));
            }
            Some("g" | "o") => {
                let name = words.collect::<Vec<_>>().join(" ");
                group = Some(group_index(&mut mesh.groups, &name));
            }
            _ => continue,
        }
        last_used_line = line.number;
    }
    if mesh.vertices.is_empty() {
        return Err(IoError::line(name, last_used_line + 1, "an OBJ mesh with vertices", "none"));
    }
    Ok(mesh)
}

fn group_index(groups: &mut Vec<String>, name: &str) -> u32 {
    let index = groups.iter().position(|group| group == name).unwrap_or_else(|| {
        groups.push(name.to_owned());
        groups.len() - 1
    });
    index as u32
}

/// The vertex of `7`, `7/1`, `7//3` or `-1` (counted back from the last vertex so far).
fn corner_vertex(line: &Line<'_>, corner: &str, vertex_count: usize) -> Result<u32, IoError> {
    const WANTED: &str = "indices of vertices before this line";
    let index: i64 = line.whole(corner.split('/').next().unwrap_or_default(), WANTED)?;
    let count = vertex_count as i64;
    let from_zero = if index < 0 { count + index } else { index - 1 };
    if (0..count).contains(&from_zero) {
        line.whole(&from_zero.to_string(), WANTED)
    } else {
        Err(line.error(WANTED, corner))
    }
}

/// Writes vertices and triangles.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write(path: impl AsRef<Path>, vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<(), IoError> {
    write_atomically(path, |file| {
        for v in vertices {
            writeln!(file, "v {} {} {}", v.x, v.y, v.z)?;
        }
        for [a, b, c] in faces {
            writeln!(file, "f {} {} {}", a + 1, b + 1, c + 1)?;
        }
        Ok(())
    })
}

/// Writes one frame of a mesh with normals, its texture coordinates and the name of its material, which is in the file
/// `library` ([`write_materials`]) beside it.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write_frame(
    path: impl AsRef<Path>,
    mesh: &AnimatedMesh<'_>,
    vertices: &[[f32; 3]],
    library: &str,
) -> Result<(), IoError> {
    write_atomically(path, |file| {
        writeln!(file, "mtllib {library}\no {0}\nusemtl {0}", mesh.name)?;
        for [x, y, z] in vertices {
            writeln!(file, "v {x} {y} {z}")?;
        }
        for [u, v] in mesh.uv.unwrap_or_default().as_flattened() {
            writeln!(file, "vt {u} {v}")?;
        }
        for [x, y, z] in normals(mesh.faces, vertices) {
            writeln!(file, "vn {x:.4} {y:.4} {z:.4}")?;
        }
        for (index, face) in mesh.faces.iter().enumerate() {
            file.write_all(b"f")?;
            for (corner, vertex) in face.iter().enumerate() {
                let vertex = vertex + 1;
                if mesh.uv.is_some() {
                    write!(file, " {vertex}/{}/{vertex}", 3 * index + corner + 1)?;
                } else {
                    write!(file, " {vertex}//{vertex}")?;
                }
            }
            file.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// Writes the materials of some meshes as an MTL file, named like them.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write_materials(path: impl AsRef<Path>, meshes: &[AnimatedMesh<'_>]) -> Result<(), IoError> {
    write_atomically(path, |file| {
        for mesh in meshes {
            let [red, green, blue, opacity] = mesh.colour;
            writeln!(file, "newmtl {}\nKd {red} {green} {blue}\nKs 0 0 0\nd {opacity}", mesh.name)?;
            writeln!(file, "Pr {}\nillum 1\n", mesh.roughness)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::{parse, read, write};
    use crate::fuzz::survives_damage;
    use modiste_core::Vec3;

    const QUADS: &str = "# a strip\r\no strip\r\nv 0 0 0\r\nv 1 0 0 # corner\r\nv 1 1 0\r\nv 0 1 .5e0\r\nvt 0 0\r\nf 1/1 2/1 3/1 4/1\r\ng flap\nv 2 0 0\nf -4//1 -1//1 -3//1\n";

    #[test]
    fn quads_groups_and_relative_indices() {
        let mesh = parse(QUADS.as_bytes(), "strip.obj").unwrap();
        assert_eq!(mesh.vertices[3], Vec3::new(0.0, 1.0, 0.5));
        assert_eq!(mesh.polygons, [vec![0, 1, 2, 3], vec![1, 4, 2]]);
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
        assert_eq!(mesh.groups, ["strip", "flap"]);
        assert_eq!(mesh.of_group("flap").collect::<Vec<_>>(), [[1, 4, 2]]);
        assert_eq!(mesh.of_group("none").count(), 0);
    }

    #[test]
    fn errors_name_the_line() {
        let message = |text: &str| parse(text.as_bytes(), "bad.obj").unwrap_err().to_string();
        let wanted = "bad.obj, line 2: wanted indices of vertices before this line, found \"2\"";
        assert_eq!(message("v 0 0 0\nf 1 2 1\n"), wanted);
        assert!(message("v 0 0 0\nf 1 0 1\n").contains("line 2"));
        assert!(message("v 0 0\n").contains("line 1: wanted three finite coordinates"));
        assert!(message("v 0 0 nan\n").contains("found \"nan\""));
        assert!(message("v 0 0 0\nf 1 1\n").contains("three or more"));
        assert!(message("").contains("line 1: wanted an OBJ mesh"));
        assert!(message("v 0 0 0\nf 1 1 99999999999999999999\n").contains("line 2"));
    }

    #[test]
    fn round_trip_is_exact() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.obj");
        let vertices = vec![Vec3::new(0.1, -1.0 / 3.0, 1e-17), Vec3::X, Vec3::Y];
        write(&path, &vertices, &[[0, 1, 2]]).unwrap();
        assert_eq!(read(&path).unwrap(), (vertices, vec![[0, 1, 2]]));
    }

    #[test]
    fn a_frame_has_normals_texture_coordinates_and_a_material() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.obj");
        let frames = vec![vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]];
        let uv = [[[0.0, 0.25], [1.0, 0.0], [0.0, 1.0]]];
        let mesh = crate::animated::AnimatedMesh {
            name: "shirt",
            faces: &[[0, 1, 2]],
            frames: &frames,
            uv: Some(&uv),
            vertex_colours: None,
            colour: [0.5, 0.25, 1.0, 1.0],
            roughness: 0.9,
            double_sided: true,
        };
        super::write_frame(&path, &mesh, &frames[0], "m.mtl").unwrap();
        super::write_materials(folder.path().join("m.mtl"), &[mesh]).unwrap();
        let text = crate::read_text(&path).unwrap();
        assert!(text.contains("mtllib m.mtl\no shirt\nusemtl shirt\n") && text.contains("\nf 1/1/1 2/2/2 3/3/3\n"));
        assert!(text.contains("vn 0.0000 0.0000 1.0000") && text.contains("vt 0 0.25"), "{text}");
        assert!(crate::read_text(folder.path().join("m.mtl")).unwrap().contains("newmtl shirt\nKd 0.5 0.25 1\n"));
        assert_eq!(read(&path).unwrap().1, [[0, 1, 2]]);
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(QUADS.as_bytes(), |bytes| drop(parse(bytes, "damaged.obj")));
    }
}
