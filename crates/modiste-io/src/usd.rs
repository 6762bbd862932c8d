//! Animated meshes as a Universal Scene Description layer in text (`.usda`).
//!
//! One component `/Figure` holds a mesh for each part with points, normals and extent sampled in every frame, texture
//! coordinates for each corner, and a `UsdPreviewSurface` bound to it. Metres, Y up, time codes are frames. Frames go to the
//! file one by one, so a layer may be longer than memory.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use crate::animated::{AnimatedMesh, check, normals};
use crate::pc2::keep;
use crate::{FileWriter, IoError, write_atomically};

/// Places after the decimal point of positions: a hundredth of a millimetre.
const POSITION_PLACES: usize = 5;
/// Of normals.
const NORMAL_PLACES: usize = 3;
/// Of texture coordinates.
const UV_PLACES: usize = 5;

/// Writes an animation.
///
/// # Errors
/// [`IoError`] naming the mesh and what is wrong with it, or the file.
pub fn write(path: impl AsRef<Path>, fps: f64, meshes: &[AnimatedMesh<'_>]) -> Result<(), IoError> {
    let path = path.as_ref();
    let frame_count = check(fps, meshes, &path.display().to_string())?;
    let names = prim_names(meshes);
    let mut unread = None;
    let written = write_atomically(path, |file| {
        let last = frame_count - 1;
        write!(
            file,
            "#usda 1.0\n(\n    defaultPrim = \"Figure\"\n    endTimeCode = {last}\n    framesPerSecond = {fps}\n    \
             metersPerUnit = 1\n    startTimeCode = 0\n    timeCodesPerSecond = {fps}\n    upAxis = \"Y\"\n)\n\n\
             def Xform \"Figure\" (\n    assetInfo = {{\n        string name = \"Figure\"\n    }}\n    kind = \"component\"\n)\n{{\n"
        )?;
        for (mesh, name) in meshes.iter().zip(&names) {
            write_mesh(file, mesh, name, &mut unread)?;
        }
        file.write_all(b"    def Scope \"Materials\"\n    {\n")?;
        for (mesh, name) in meshes.iter().zip(&names) {
            write_material(file, mesh, name)?;
        }
        file.write_all(b"    }\n}\n")
    });
    unread.map_or(written, Err)
}

/// Writes a layer that holds others, each as a figure where its own layer puts it: name and file, relative to this one.
///
/// # Errors
/// [`IoError`] naming the file.
pub fn write_references(
    path: impl AsRef<Path>,
    fps: f64,
    frame_count: usize,
    layers: &[(String, String)],
) -> Result<(), IoError> {
    write_atomically(path, |file| {
        let last = frame_count.saturating_sub(1);
        write!(
            file,
            "#usda 1.0\n(\n    defaultPrim = \"Crowd\"\n    endTimeCode = {last}\n    framesPerSecond = {fps}\n    \
             metersPerUnit = 1\n    startTimeCode = 0\n    timeCodesPerSecond = {fps}\n    upAxis = \"Y\"\n)\n\n\
             def Xform \"Crowd\" (\n    kind = \"group\"\n)\n{{\n"
        )?;
        for (name, layer) in layers {
            writeln!(file, "    def \"{name}\" (\n        prepend references = @{layer}@\n    )\n    {{\n    }}\n")?;
        }
        file.write_all(b"}\n")
    })
}

/// Names that a prim may have, each once: letters, digits and underscores, no digit first.
fn prim_names(meshes: &[AnimatedMesh<'_>]) -> Vec<String> {
    let mut names: Vec<String> = vec!["Materials".to_owned()];
    for mesh in meshes {
        let mut name: String =
            mesh.name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
        if !name.starts_with(|letter: char| letter.is_ascii_alphabetic() || letter == '_') {
            name.insert(0, '_');
        }
        while names.contains(&name) {
            name.push('_');
        }
        names.push(name);
    }
    names.split_off(1)
}

fn write_mesh(
    file: &mut FileWriter,
    mesh: &AnimatedMesh<'_>,
    name: &str,
    unread: &mut Option<IoError>,
) -> io::Result<()> {
    writeln!(file, "    def Mesh \"{name}\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {{")?;
    writeln!(file, "        uniform bool doubleSided = {}", u8::from(mesh.double_sided))?;
    sampled(file, "float3[] extent", mesh, unread, |vertices, text| {
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            vertices.iter().fold([start; 3], |bound, v| std::array::from_fn(|axis| pick(bound[axis], v[axis])))
        };
        tuples(text, &[bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY)], POSITION_PLACES);
    })?;
    list(file, "int[] faceVertexCounts", mesh.faces.iter().map(|face| face.len() as u32))?;
    list(file, "int[] faceVertexIndices", mesh.faces.as_flattened().iter().copied())?;
    writeln!(file, "        rel material:binding = </Figure/Materials/{name}>")?;
    sampled(file, "normal3f[] normals", mesh, unread, |vertices, text| {
        tuples(text, &normals(mesh.faces, vertices), NORMAL_PLACES);
    })?;
    sampled(file, "point3f[] points", mesh, unread, |vertices, text| tuples(text, vertices, POSITION_PLACES))?;
    if let Some(colours) = mesh.vertex_colours {
        let mut text = String::new();
        tuples(&mut text, colours, NORMAL_PLACES);
        writeln!(
            file,
            "        color3f[] primvars:displayColor = {text} (\n            interpolation = \"vertex\"\n        )"
        )?;
    }
    if let Some(uv) = mesh.uv {
        let mut text = String::new();
        tuples(&mut text, uv.as_flattened(), UV_PLACES);
        writeln!(
            file,
            "        texCoord2f[] primvars:st = {text} (\n            interpolation = \"faceVarying\"\n        )"
        )?;
    }
    file.write_all(b"        uniform token subdivisionScheme = \"none\"\n    }\n\n")
}

/// An attribute with a value for every frame, or one for a mesh at rest.
fn sampled(
    file: &mut FileWriter,
    declaration: &str,
    mesh: &AnimatedMesh<'_>,
    unread: &mut Option<IoError>,
    spell: impl Fn(&[[f32; 3]], &mut String),
) -> io::Result<()> {
    let mut text = String::new();
    let mut vertices = Vec::new();
    let frame_count = mesh.frames.frame_count();
    let (open, close) = if frame_count > 1 { (".timeSamples = {\n", "        }\n") } else { (" = ", "\n") };
    write!(file, "        {declaration}{open}")?;
    for frame in 0..frame_count {
        keep(unread, mesh.frames.read(frame, &mut vertices))?;
        text.clear();
        spell(&vertices, &mut text);
        if frame_count > 1 {
            writeln!(file, "            {frame}: {text},")?;
        } else {
            file.write_all(text.as_bytes())?;
        }
    }
    file.write_all(close.as_bytes())
}

fn list(file: &mut FileWriter, declaration: &str, numbers: impl Iterator<Item = u32>) -> io::Result<()> {
    let text: Vec<String> = numbers.map(|number| number.to_string()).collect();
    writeln!(file, "        {declaration} = [{}]", text.join(", "))
}

/// `[(x, y, z), …]`, rounded to some places after the point.
fn tuples<const N: usize>(text: &mut String, rows: &[[f32; N]], places: usize) {
    text.push('[');
    for (index, row) in rows.iter().enumerate() {
        text.push_str(if index == 0 { "(" } else { ", (" });
        for (axis, value) in row.iter().enumerate() {
            let comma = if axis == 0 { "" } else { ", " };
            // Writing to a string cannot fail.
            let _always_ok = write!(text, "{comma}{value:.places$}");
        }
        text.push(')');
    }
    text.push(']');
}

fn write_material(file: &mut FileWriter, mesh: &AnimatedMesh<'_>, name: &str) -> io::Result<()> {
    let [red, green, blue, opacity] = mesh.colour;
    let colour = if mesh.vertex_colours.is_some() {
        format!("color3f inputs:diffuseColor.connect = </Figure/Materials/{name}/Colours.outputs:result>")
    } else {
        format!("color3f inputs:diffuseColor = ({red}, {green}, {blue})")
    };
    write!(
        file,
        "        def Material \"{name}\"\n        {{\n            token outputs:surface.connect = \
         </Figure/Materials/{name}/Surface.outputs:surface>\n\n            def Shader \"Surface\"\n            {{\n                \
         uniform token info:id = \"UsdPreviewSurface\"\n                {colour}\n                float inputs:metallic = 0\n                \
         float inputs:opacity = {opacity}\n                float inputs:roughness = {}\n                token outputs:surface\n            }}\n",
        mesh.roughness
    )?;
    if mesh.vertex_colours.is_some() {
        file.write_all(
            b"\n            def Shader \"Colours\"\n            {\n                uniform token info:id = \
              \"UsdPrimvarReader_float3\"\n                string inputs:varname = \"displayColor\"\n                \
              float3 outputs:result\n            }\n",
        )?;
    }
    file.write_all(b"        }\n\n")
}

#[cfg(test)]
mod tests {
    use super::write;
    use crate::animated::AnimatedMesh;

    #[test]
    fn a_layer_has_samples_materials_and_names_that_are_allowed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.usda");
        let frames: Vec<Vec<[f32; 3]>> =
            (0..3).map(|frame| vec![[frame as f32, 0.5, -2.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1e-7]]).collect();
        let uv = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]];
        let mesh = |name, uv| AnimatedMesh {
            name,
            faces: &[[0, 1, 2]],
            frames: &frames,
            uv,
            vertex_colours: None,
            colour: [0.5, 0.25, 1.0, 1.0],
            roughness: 0.9,
            double_sided: true,
        };
        write(&path, 30.0, &[mesh("t-shirt", Some(&uv[..])), mesh("2nd", None), mesh("t shirt", None)]).unwrap();
        let text = crate::read_text(&path).unwrap();
        for wanted in [
            "#usda 1.0\n",
            "endTimeCode = 2",
            "metersPerUnit = 1",
            "def Mesh \"t_shirt\"",
            "def Mesh \"_2nd\"",
            "def Mesh \"t_shirt_\"",
            "            1: [(1.00000, 0.50000, -2.00000), (1.00000, 1.00000, 0.00000), (0.00000, 1.00000, 0.00000)],\n",
            "primvars:st = [(0.00000, 0.00000), (1.00000, 0.00000), (0.00000, 1.00000)]",
            "int[] faceVertexCounts = [3]",
            "rel material:binding = </Figure/Materials/_2nd>",
            "inputs:diffuseColor = (0.5, 0.25, 1)",
        ] {
            assert!(text.contains(wanted), "{wanted} in {text}");
        }
        assert_eq!(text.matches('{').count(), text.matches('}').count());
        assert!(write(&path, 30.0, &[]).is_err());
    }
}
